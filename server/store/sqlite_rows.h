// Jobs and scenes as rows of the database; internal to the SQLite store.
#pragma once

#include <string>
#include <vector>

#include "server/store/job.h"
#include "server/store/sqlite_db.h"

namespace color3d {

// "select <columns> from job <tail>", and such a row as a record (without artifacts).
std::string SelectJob(const std::string& tail);
// The same with an empty spec.
std::string SelectJobWithoutSpec(const std::string& tail);
JobRecord JobFromRow(const SqliteStatement& row);
// A new row with all of the record but its id; returns the id.
int64_t InsertJobRow(SqliteDatabase& db, const JobRecord& job);

// The same for scenes (without files).
std::string SelectScene(const std::string& tail);
SceneRecord SceneFromRow(const SqliteStatement& row);
int64_t InsertSceneRow(SqliteDatabase& db, const SceneRecord& scene);

// Warnings are single lines, stored joined by newlines; beyond 64 KiB they are left out.
std::string JoinLines(const std::vector<std::string>& lines);
std::vector<std::string> SplitLines(const std::string& text);

// "1,2,3": ids are our own integers, so building SQL from them is safe.
std::string JoinIds(const std::vector<int64_t>& ids);

}  // namespace color3d
