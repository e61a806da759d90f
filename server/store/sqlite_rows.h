// Jobs and scenes as rows of the database; internal to the SQLite store.
#pragma once

#include <string>
#include <vector>

#include "server/store/job.h"
#include "server/store/sqlite_db.h"

namespace color3d {

// Returns "select <columns> from job <tail>"; JobFromRow reads its rows, without artifacts.
std::string SelectJob(const std::string& tail);
// The same with empty specs.
std::string SelectJobWithoutSpec(const std::string& tail);
JobRecord JobFromRow(const SqliteStatement& row);
// Inserts the record except for its id; returns the new id.
int64_t InsertJobRow(SqliteDatabase& db, const JobRecord& job);

// The same for scenes (without files).
std::string SelectScene(const std::string& tail);
SceneRecord SceneFromRow(const SqliteStatement& row);
int64_t InsertSceneRow(SqliteDatabase& db, const SceneRecord& scene);

// Warnings are stored as lines of one text; those beyond 64 KiB are dropped.
std::string JoinLines(const std::vector<std::string>& lines);
std::vector<std::string> SplitLines(const std::string& text);

// Returns "1,2,3" for SQL; safe, because ids are integers of the store.
std::string JoinIds(const std::vector<int64_t>& ids);

}  // namespace color3d
