// Jobs, scenes and workers as rows of the database; internal to the store.
#pragma once

#include <string>
#include <vector>

#include "server/store/job.h"
#include "server/store/sql_database.h"

namespace color3d {

// Amount by which a claim moves the turn of a project with weight 1; divisible by most weights.
constexpr int64_t kProjectTurn = 5'040'000;

// Returns "select <columns> from job <tail>"; JobFromRow reads its rows, without artifacts.
std::string SelectJob(const std::string& tail);
// The same with empty specs.
std::string SelectJobWithoutSpec(const std::string& tail);
JobRecord JobFromRow(const SqlStatement& row);
// Inserts the record except for its id; returns the new id.
int64_t InsertJobRow(SqlDatabase& db, const JobRecord& job);

// The same for scenes (without files).
std::string SelectScene(const std::string& tail);
SceneRecord SceneFromRow(const SqlStatement& row);
int64_t InsertSceneRow(SqlDatabase& db, const SceneRecord& scene);

// Returns the workers, sorted by id.
std::vector<WorkerRecord> SelectWorkers(SqlDatabase& db);
// Inserts or replaces a worker.
void StoreWorkerRow(SqlDatabase& db, WorkerRecord worker);

// Warnings are stored as lines of one text; those beyond 64 KiB are dropped.
std::string JoinLines(const std::vector<std::string>& lines);
std::vector<std::string> SplitLines(const std::string& text);

// Returns "1,2,3" for SQL, "0", which is no id, if there are none; safe, because ids are integers
// of the store.
std::string JoinIds(const std::vector<int64_t>& ids);

}  // namespace color3d
