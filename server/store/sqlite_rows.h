// Reading job and scene rows; internal to the SQLite store.
#pragma once

#include <string>
#include <vector>

#include "server/store/job.h"
#include "server/store/sqlite_db.h"

namespace color3d {

// The columns that JobFromRow expects, in its order.
constexpr char kJobColumns[] =
    "job_id, name, parent, kind, scene, spec, state, cancel_requested, priority, attempt, "
    "max_attempts, lease_epoch, progress_step, progress_total, progress_message, "
    "progress_error_name, progress_error_value, seconds, eta_seconds, error_code, error_reason, "
    "error_message, skip_reason, skipped_by_plan, cached, warnings, checkpoint_sha256, "
    "checkpoint_bytes, create_ms, start_ms, end_ms, lease_owner, revision, peak_memory_bytes";

JobRecord JobFromRow(const SqliteStatement& row);

// "select <job columns> from job <tail>".
std::string SelectJob(const std::string& tail);

// Warnings are single lines, stored joined by newlines.
std::string JoinLines(const std::vector<std::string>& lines);
std::vector<std::string> SplitLines(const std::string& text);

// "1,2,3": ids are our own integers, so building SQL from them is safe.
std::string JoinIds(const std::vector<int64_t>& ids);

}  // namespace color3d
