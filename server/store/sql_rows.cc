#include "server/store/sql_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <type_traits>

namespace color3d {
namespace {

constexpr size_t kMaxLinesBytes = 64 << 10;

// Columns of a table and the members of a record that hold their values, for reading and inserting.
// The first is the id, which the database assigns.
template <typename Visit>
void VisitColumns(JobRecord& job, Visit&& visit) {
  JobError error = job.error.value_or(JobError{});
  FileDigest checkpoint = job.checkpoint.value_or(FileDigest{});
  visit("job_id", job.id);
  visit("name", job.name);
  visit("parent", job.parent);
  visit("kind", job.kind);
  visit("scene", job.scene);
  visit("spec", job.spec);
  visit("project", job.project);
  visit("state", job.state);
  visit("cancel_requested", job.cancel_requested);
  visit("priority", job.priority);
  visit("deadline_ms", job.deadline_ms);
  visit("needs_memory_bytes", job.needs.memory_bytes);
  visit("needs_models", job.needs.models);
  visit("batch_group", job.needs.batch_group);
  visit("preferred_worker", job.preferred_worker);
  visit("attempt", job.attempt);
  visit("max_attempts", job.max_attempts);
  visit("lease_epoch", job.lease_epoch);
  visit("lease_owner", job.worker);
  visit("progress_step", job.progress.step);
  visit("progress_total", job.progress.total_steps);
  visit("progress_message", job.progress.message);
  visit("progress_error_name", job.progress.error_name);
  visit("progress_error_value", job.progress.error_value);
  visit("eta_seconds", job.progress.eta_seconds);
  visit("seconds", job.usage.seconds);
  visit("peak_memory_bytes", job.usage.peak_memory_bytes);
  visit("warnings", job.usage.warnings);
  visit("error_code", error.code);
  visit("error_reason", error.reason);
  visit("error_message", error.message);
  visit("skip_reason", job.skip_reason);
  visit("skipped_by_plan", job.skipped_by_plan);
  visit("cached", job.cached);
  visit("pinned", job.pinned);
  visit("notify_url", job.notify_url);
  visit("trace", job.trace);
  visit("queued_ms", job.queued_ms);
  visit("queued_since_ms", job.queued_since_ms);
  visit("checkpoint_sha256", checkpoint.sha256);
  visit("checkpoint_bytes", checkpoint.size_bytes);
  visit("create_ms", job.create_ms);
  visit("start_ms", job.start_ms);
  visit("end_ms", job.end_ms);
  visit("revision", job.revision);
  visit("row_bytes", job.row_bytes);
  if (!error.reason.empty()) job.error = error;
  if (!checkpoint.sha256.empty()) job.checkpoint = checkpoint;
}

template <typename Visit>
void VisitColumns(SceneRecord& scene, Visit&& visit) {
  visit("scene_id", scene.id);
  visit("name", scene.name);
  visit("project", scene.project);
  visit("display_name", scene.display_name);
  visit("active", scene.state);
  visit("layout", scene.layout);
  visit("photo_count", scene.photo_count);
  visit("create_ms", scene.create_ms);
  visit("commit_ms", scene.commit_ms);
  visit("key_color_job", scene.key_color_job);
  visit("row_bytes", scene.row_bytes);
}

// `worker_id` is the key.
template <typename Visit>
void VisitColumns(WorkerRecord& worker, Visit&& visit) {
  visit("worker_id", worker.worker_id);
  visit("pid", worker.pid);
  visit("job", worker.job);
  visit("memory_bytes", worker.memory_bytes);
  visit("heartbeat_ms", worker.heartbeat_ms);
  visit("machine", worker.machine);
  visit("release", worker.release);
  visit("threads", worker.threads);
  visit("memory_limit_bytes", worker.memory_limit_bytes);
  visit("simd", worker.simd);
  visit("cache_bytes", worker.cache_bytes);
  visit("cache_limit_bytes", worker.cache_limit_bytes);
  visit("cache_hit_bytes", worker.cache_hit_bytes);
  visit("cache_miss_bytes", worker.cache_miss_bytes);
  visit("finished_jobs", worker.finished_jobs);
}

template <typename T>
void Read(const SqlStatement& row, int column, T* value) {
  if constexpr (std::is_same_v<T, std::string>) {
    *value = row.Text(column);
  } else if constexpr (std::is_same_v<T, std::vector<std::string>>) {
    *value = SplitLines(row.Text(column));
  } else if constexpr (std::is_same_v<T, JobState>) {
    *value = JobStateFromName(row.Text(column));
  } else if constexpr (std::is_same_v<T, double>) {
    *value = row.Double(column);
  } else if constexpr (std::is_same_v<T, bool>) {
    *value = row.Int(column) != 0;
  } else {  // integers and enumerations
    *value = static_cast<T>(row.Int(column));
  }
}

template <typename T>
void Write(SqlStatement& statement, const T& value) {
  if constexpr (std::is_same_v<T, std::vector<std::string>>) {
    statement.Bind(JoinLines(value));
  } else if constexpr (std::is_same_v<T, JobState>) {
    statement.Bind(JobStateName(value));
  } else if constexpr (std::is_enum_v<T>) {
    statement.Bind(static_cast<int64_t>(value));
  } else {
    statement.Bind(value);
  }
}

template <typename T>
void WriteBytes(SqlStatement& statement, const T& value) {
  if constexpr (std::is_same_v<T, std::string>) statement.Bind(SqlBytes{value});
}

template <typename Record>
std::vector<std::string> ColumnNames() {
  std::vector<std::string> names;
  Record record;
  VisitColumns(record, [&](const char* name, auto&) { names.emplace_back(name); });
  return names;
}

template <typename Record>
Record RecordFromRow(const SqlStatement& row) {
  Record record;
  int column = 0;
  VisitColumns(record, [&](const char*, auto& value) { Read(row, column++, &value); });
  return record;
}

template <typename Record>
int64_t InsertRow(SqlDatabase& db, const char* table, Record record) {
  static const std::vector<std::string> names = ColumnNames<Record>();
  const auto inserted = names.begin() + 1;  // all except the id
  const std::vector<const char*> places(names.size() - 1, "?");
  SqlStatement insert(db,
                      fmt::format("insert into {}({}) values({}) returning {}",
                                  table,
                                  fmt::join(inserted, names.end(), ", "),
                                  fmt::join(places, ","),
                                  names.front()));
  VisitColumns(record, [&](const char* name, const auto& value) {
    if (name == std::string_view("spec")) {
      WriteBytes(insert, value);
    } else if (name != names.front()) {
      Write(insert, value);
    }
  });
  return insert.NextInt();
}

}  // namespace

std::string SelectJob(const std::string& tail) {
  static const std::string columns = fmt::format("{}", fmt::join(ColumnNames<JobRecord>(), ", "));
  return fmt::format("select {} from job {}", columns, tail);
}

std::string SelectJobWithoutSpec(const std::string& tail) {
  static const std::string columns = [] {
    std::vector<std::string> names = ColumnNames<JobRecord>();
    std::ranges::replace(names, "spec", "''");
    return fmt::format("{}", fmt::join(names, ", "));
  }();
  return fmt::format("select {} from job {}", columns, tail);
}

JobRecord JobFromRow(const SqlStatement& row) { return RecordFromRow<JobRecord>(row); }

int64_t InsertJobRow(SqlDatabase& db, const JobRecord& job) { return InsertRow(db, "job", job); }

std::string SelectScene(const std::string& tail) {
  static const std::string columns = fmt::format("{}", fmt::join(ColumnNames<SceneRecord>(), ", "));
  return fmt::format("select {} from scene {}", columns, tail);
}

SceneRecord SceneFromRow(const SqlStatement& row) { return RecordFromRow<SceneRecord>(row); }

int64_t InsertSceneRow(SqlDatabase& db, const SceneRecord& scene) {
  return InsertRow(db, "scene", scene);
}

std::vector<WorkerRecord> SelectWorkers(SqlDatabase& db) {
  static const std::string select = fmt::format("select {} from worker order by worker_id",
                                                fmt::join(ColumnNames<WorkerRecord>(), ", "));
  return SqlStatement(db, select).All(RecordFromRow<WorkerRecord>);
}

void StoreWorkerRow(SqlDatabase& db, WorkerRecord worker) {
  static const std::string store = [] {
    const std::vector<std::string> names = ColumnNames<WorkerRecord>();
    std::vector<std::string> updates;
    for (size_t i = 1; i < names.size(); ++i) updates.push_back(names[i] + "=excluded." + names[i]);
    return fmt::format("insert into worker({}) values({}) on conflict(worker_id) do update set {}",
                       fmt::join(names, ", "),
                       fmt::join(std::vector<const char*>(names.size(), "?"), ","),
                       fmt::join(updates, ", "));
  }();
  SqlStatement statement(db, store);
  VisitColumns(worker, [&](const char*, const auto& value) { Write(statement, value); });
  statement.Step();
}

std::string JoinLines(const std::vector<std::string>& lines) {
  std::string text;
  for (std::string line : lines) {
    std::replace(line.begin(), line.end(), '\n', ' ');
    if (text.size() + line.size() > kMaxLinesBytes) break;
    if (!text.empty()) text += '\n';
    text += line;
  }
  return text;
}

std::vector<std::string> SplitLines(const std::string& text) {
  std::vector<std::string> lines;
  size_t start = 0;
  while (start < text.size()) {
    size_t end = text.find('\n', start);
    if (end == std::string::npos) end = text.size();
    lines.push_back(text.substr(start, end - start));
    start = end + 1;
  }
  return lines;
}

std::string JoinIds(const std::vector<int64_t>& ids) {
  if (ids.empty()) return "0";
  return fmt::format("{}", fmt::join(ids, ","));
}

}  // namespace color3d
