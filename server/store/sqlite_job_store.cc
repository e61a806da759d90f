// Opening, reading, idempotency and housekeeping. The state machine is in sqlite_job_state.cc, what
// workers call in sqlite_job_lease.cc, scenes and colorizers in sqlite_scene.cc.
#include "server/store/sqlite_job_store.h"

#include <algorithm>
#include <utility>

#include "server/service_error.h"
#include "server/store/schema.h"
#include "server/store/sqlite_db.h"
#include "server/store/sqlite_rows.h"

namespace color3d {

SqliteJobStore::SqliteJobStore(const std::filesystem::path& file, Clock clock, StoreOptions options)
    : db_(std::make_unique<SqliteDatabase>(file)), clock_(std::move(clock)), options_(options) {
  OpenSchema();
}

SqliteJobStore::~SqliteJobStore() = default;

void SqliteJobStore::OpenSchema() {
  // Taken even when only reading the version: two processes may open a fresh file together.
  SqliteTransaction transaction(*db_);
  db_->Exec("create table if not exists schema_version(version integer not null)");
  SqliteStatement version(db_->handle(), "select version from schema_version");
  if (version.Step()) {
    if (version.Int(0) == 1) {
      db_->Exec(kAddKeyColorJob);
      db_->Run("update schema_version set version=?", kSchemaVersion);
      transaction.Commit();
      return;
    }
    if (version.Int(0) != kSchemaVersion) {
      throw ServiceError(
          ErrorCode::kFailedPrecondition,
          "STORE_VERSION",
          "the job store has version {}, this program reads version {}; use the program "
          "that wrote it, or another --data-dir",
          version.Int(0),
          kSchemaVersion);
    }
    return;
  }
  db_->Exec(kSchema);
  db_->Run("insert into schema_version values(?)", kSchemaVersion);
  transaction.Commit();
}

std::optional<JobRecord> SqliteJobStore::FindJob(const std::string& name) {
  SqliteStatement select(db_->handle(), SelectJob("where name=?"));
  select.Bind(name);
  if (!select.Step()) return std::nullopt;
  JobRecord job = JobFromRow(select);
  job.artifacts = LoadArtifacts(job.id);
  return job;
}

JobRecord SqliteJobStore::RequireJob(const std::string& name) {
  std::optional<JobRecord> job = FindJob(name);
  if (!job) {
    throw ServiceError(ErrorCode::kNotFound, "JOB_NOT_FOUND", "there is no job '{}'", name);
  }
  return *std::move(job);
}

JobRecord SqliteJobStore::JobById(int64_t job_id) {
  SqliteStatement select(db_->handle(), SelectJob("where job_id=?"));
  select.Bind(job_id);
  if (!select.Step()) {
    throw Error(ErrorCode::kNotFound, "job {} was deleted", job_id);
  }
  JobRecord job = JobFromRow(select);
  job.artifacts = LoadArtifacts(job.id);
  return job;
}

std::vector<ArtifactRecord> SqliteJobStore::LoadArtifacts(int64_t job_id) {
  SqliteStatement select(
      db_->handle(),
      "select name, sha256, size_bytes, media_type from artifact where job_id=? order by name");
  select.Bind(job_id);
  std::vector<ArtifactRecord> artifacts;
  while (select.Step()) {
    artifacts.push_back({select.Text(0), {select.Text(1), select.Int(2)}, select.Text(3)});
  }
  return artifacts;
}

std::vector<JobRecord> SqliteJobStore::ReadJobs(SqliteStatement& select) {
  std::vector<JobRecord> jobs;
  while (select.Step()) jobs.push_back(JobFromRow(select));
  for (JobRecord& job : jobs) job.artifacts = LoadArtifacts(job.id);
  return jobs;
}

std::vector<JobRecord> SqliteJobStore::GraphOf(const JobRecord& root) {
  std::vector<JobRecord> jobs;
  SqliteStatement select(db_->handle(), SelectJob("where parent=? order by job_id"));
  select.Bind(root.name);
  while (select.Step()) jobs.push_back(JobFromRow(select));
  jobs.push_back(root);
  return jobs;
}

JobRecord SqliteJobStore::GetJob(const std::string& name) {
  std::lock_guard lock(mutex_);
  return RequireJob(name);
}

std::vector<JobRecord> SqliteJobStore::ListJobs(const JobFilter& filter,
                                                int64_t before_id,
                                                int limit) {
  std::lock_guard lock(mutex_);
  std::string tail = "where job_id < ?";
  if (!filter.parent.empty()) tail += " and parent=?";
  if (!filter.scene.empty()) tail += " and scene=?";
  SqliteStatement select(db_->handle(), SelectJob(tail + " order by job_id desc limit ?"));
  select.Bind(before_id > 0 ? before_id : INT64_MAX);
  if (!filter.parent.empty()) select.Bind(filter.parent);
  if (!filter.scene.empty()) select.Bind(filter.scene);
  select.Bind(limit);
  return ReadJobs(select);
}

std::vector<JobRecord> SqliteJobStore::ListChildren(const std::string& name) {
  std::lock_guard lock(mutex_);
  SqliteStatement select(db_->handle(), SelectJob("where parent=? order by job_id"));
  select.Bind(name);
  return ReadJobs(select);
}

std::optional<std::string> SqliteJobStore::CheckRequest(const RequestKey& request) {
  if (request.id.empty()) return std::nullopt;
  SqliteStatement select(db_->handle(),
                         "select body_sha256, resource from request_id where method=? and id=?");
  select.Bind(request.method, request.id);
  if (!select.Step()) return std::nullopt;
  if (select.Text(0) != request.body_sha256) {
    throw ServiceError(ErrorCode::kInvalidArgument,
                       "REQUEST_ID_REUSED",
                       "request_id '{}' was used for another {} request; choose a fresh one",
                       request.id,
                       request.method);
  }
  return select.Text(1);
}

void SqliteJobStore::RecordRequest(const RequestKey& request, const std::string& resource) {
  if (request.id.empty()) return;
  db_->Run("insert into request_id values(?,?,?,?,?)",
           request.method,
           request.id,
           request.body_sha256,
           resource,
           Now());
}

std::optional<std::string> SqliteJobStore::FindRequest(const RequestKey& request) {
  std::lock_guard lock(mutex_);
  return CheckRequest(request);
}

int64_t SqliteJobStore::NewestRevision() {
  std::lock_guard lock(mutex_);
  // Not max(revision): the newest event may have been deleted with its job.
  SqliteStatement select(db_->handle(), "select seq from sqlite_sequence where name='job_event'");
  return select.Step() ? select.Int(0) : 0;
}

namespace {

std::vector<EventRecord> ReadEvents(SqliteStatement& select) {
  std::vector<EventRecord> events;
  while (select.Step()) {
    EventRecord event;
    event.revision = select.Int(0);
    event.job_id = select.Int(1);
    event.kind = select.Int(2) != 0 ? EventKind::kProgress : EventKind::kState;
    event.state = JobStateFromName(select.Text(3));
    event.attempt = static_cast<int>(select.Int(4));
    event.time_ms = select.Int(5);
    events.push_back(event);
  }
  return events;
}

}  // namespace

std::vector<EventRecord> SqliteJobStore::EventsSince(int64_t revision, int limit) {
  std::lock_guard lock(mutex_);
  SqliteStatement select(db_->handle(),
                         "select revision, job_id, progress, state, attempt, at_ms from job_event "
                         "where revision > ? order by revision limit ?");
  select.Bind(revision, limit);
  return ReadEvents(select);
}

std::vector<EventRecord> SqliteJobStore::EventsSince(int64_t revision,
                                                     const std::vector<int64_t>& job_ids,
                                                     int limit) {
  std::lock_guard lock(mutex_);
  SqliteStatement bounds(db_->handle(),
                         "select (select value from meta where name='compacted_revision'), "
                         "coalesce((select seq from sqlite_sequence where name='job_event'), 0)");
  bounds.Step();
  if (revision < bounds.Int(0) || revision > bounds.Int(1)) {
    throw ServiceError(ErrorCode::kFailedPrecondition,
                       "REVISION_COMPACTED",
                       "events after revision {} are not kept (kept: {} to {}); get the jobs again "
                       "and watch from revision 0",
                       revision,
                       bounds.Int(0),
                       bounds.Int(1));
  }
  SqliteStatement select(db_->handle(),
                         "select revision, job_id, progress, state, attempt, at_ms from job_event "
                         "where job_id in (" +
                             JoinIds(job_ids) + ") and revision > ? order by revision limit ?");
  select.Bind(revision, limit);
  return ReadEvents(select);
}

bool SqliteJobStore::AllFinished(const std::vector<int64_t>& job_ids) {
  std::lock_guard lock(mutex_);
  SqliteStatement select(
      db_->handle(),
      "select 1 from job where end_ms=0 and job_id in (" + JoinIds(job_ids) + ") limit 1");
  return !select.Step();
}

JobsSnapshot SqliteJobStore::Snapshot(const std::vector<int64_t>& job_ids) {
  std::lock_guard lock(mutex_);
  JobsSnapshot snapshot;
  db_->Exec("begin");  // one consistent read
  try {
    SqliteStatement sequence(db_->handle(),
                             "select seq from sqlite_sequence where name='job_event'");
    if (sequence.Step()) snapshot.revision = sequence.Int(0);
    SqliteStatement select(
        db_->handle(), SelectJob("where job_id in (" + JoinIds(job_ids) + ") order by revision"));
    snapshot.jobs = ReadJobs(select);
  } catch (...) {
    db_->Exec("rollback");
    throw;
  }
  db_->Exec("commit");
  return snapshot;
}

std::vector<int64_t> SqliteJobStore::ResolveWatch(const std::vector<std::string>& names) {
  std::lock_guard lock(mutex_);
  std::set<int64_t> ids;
  for (const std::string& name : names) {
    for (const JobRecord& job : GraphOf(RequireJob(name))) ids.insert(job.id);
  }
  return {ids.begin(), ids.end()};
}

JobCounts SqliteJobStore::CountJobs() {
  std::lock_guard lock(mutex_);
  SqliteStatement select(db_->handle(),
                         "select coalesce(sum(state in('QUEUED','BLOCKED')),0), "
                         "coalesce(sum(state='RUNNING'),0) from job where end_ms=0");
  select.Step();
  return {select.Int(0), select.Int(1)};
}

void SqliteJobStore::UpdateWorker(const WorkerRecord& worker) {
  std::lock_guard lock(mutex_);
  SqliteTransaction transaction(*db_, /*durable=*/false);
  db_->Run(
      "insert into worker values(?,?,?,?,?) on conflict(worker_id) do update set "
      "pid=excluded.pid, job=excluded.job, memory_bytes=excluded.memory_bytes, "
      "heartbeat_ms=excluded.heartbeat_ms",
      worker.worker_id,
      worker.pid,
      worker.job,
      worker.memory_bytes,
      Now());
  transaction.Commit();
}

void SqliteJobStore::RemoveWorker(const std::string& worker_id) {
  std::lock_guard lock(mutex_);
  SqliteTransaction transaction(*db_, /*durable=*/false);
  db_->Run("delete from worker where worker_id=?", worker_id);
  transaction.Commit();
}

std::vector<WorkerRecord> SqliteJobStore::ListWorkers() {
  std::lock_guard lock(mutex_);
  SqliteStatement select(
      db_->handle(),
      "select worker_id, pid, job, memory_bytes, heartbeat_ms from worker order by worker_id");
  std::vector<WorkerRecord> workers;
  while (select.Step()) {
    workers.push_back(
        {select.Text(0), select.Int(1), select.Text(2), select.Int(3), select.Int(4)});
  }
  return workers;
}

void SqliteJobStore::Compact(int64_t events_before_ms, int64_t requests_before_ms) {
  std::lock_guard lock(mutex_);
  SqliteTransaction transaction(*db_);
  constexpr char kOld[] =
      "from job_event where at_ms < ? and job_id in (select job_id from job where end_ms <> 0)";
  SqliteStatement newest(
      db_->handle(), std::string("select coalesce(max(revision), 0) ") + kOld + " and progress=0");
  newest.Bind(events_before_ms);
  newest.Step();
  db_->Run("update meta set value=max(value, ?) where name='compacted_revision'", newest.Int(0));
  db_->Run(std::string("delete ") + kOld, events_before_ms);
  db_->Run("delete from request_id where at_ms < ?", requests_before_ms);
  transaction.Commit();
}

namespace {
constexpr char kReferences[] =
    "select sha256 from artifact union select sha256 from scene_file "
    "union select sha256 from job_blob "
    "union select checkpoint_sha256 from job where checkpoint_sha256 <> ''";
}  // namespace

std::set<std::string> SqliteJobStore::ReferencedBlobs() {
  std::lock_guard lock(mutex_);
  SqliteStatement select(db_->handle(), kReferences);
  std::set<std::string> digests;
  while (select.Step()) digests.insert(select.Text(0));
  return digests;
}

bool SqliteJobStore::IsReferenced(const std::string& sha256) {
  std::lock_guard lock(mutex_);
  SqliteStatement select(
      db_->handle(),
      "select exists(select 1 from artifact where sha256=?1) or "
      "exists(select 1 from scene_file where sha256=?1) or "
      "exists(select 1 from job_blob where sha256=?1) or "
      "exists(select 1 from job where checkpoint_sha256=?1 and checkpoint_sha256 <> '')");
  select.Bind(sha256);
  select.Step();
  return select.Int(0) != 0;
}

int64_t SqliteJobStore::RunningEpoch(const std::string& job_name) {
  std::lock_guard lock(mutex_);
  SqliteStatement select(db_->handle(),
                         "select lease_epoch from job where name=? and state='RUNNING'");
  select.Bind(job_name);
  return select.Step() ? select.Int(0) : 0;
}

}  // namespace color3d
