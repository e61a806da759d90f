// Opening, reading and idempotency. State machine: sqlite_job_state.cc; calls of workers:
// sqlite_job_lease.cc; scenes and colorizers: sqlite_scene.cc; chores: sqlite_chores.cc.
#include "server/store/sqlite_job_store.h"

#include <utility>

#include "server/base/service_error.h"
#include "server/store/sqlite_db.h"
#include "server/store/sqlite_rows.h"

namespace color3d {
namespace {

const std::filesystem::path& Prepared(const std::filesystem::path& file,
                                      StoreRole role,
                                      const StoreOptions& options) {
  PrepareStore(file, role, {options.program_version, options.boot_id});
  return file;
}

}  // namespace

SqliteJobStore::SqliteJobStore(const std::filesystem::path& file,
                               StoreRole role,
                               Clocks clocks,
                               StoreOptions options)
    : file_(file),
      connections_(Prepared(file, role, options)),
      clocks_(std::move(clocks)),
      options_(options) {}

SqliteJobStore::~SqliteJobStore() = default;

namespace {

ServiceError JobNotFound(const std::string& name) {
  return ServiceError(ErrorReason::kJobNotFound, "there is no job '{}'", name);
}

}  // namespace

std::optional<JobRecord> SqliteJobStore::FindJob(SqliteDatabase& db, const std::string& name) {
  SqliteStatement select(db, SelectJob("where name=?"), name);
  if (!select.Step()) return std::nullopt;
  JobRecord job = JobFromRow(select);
  job.artifacts = LoadArtifacts(db, job.id);
  return job;
}

JobRecord SqliteJobStore::RequireJob(SqliteDatabase& db, const std::string& name) {
  std::optional<JobRecord> job = FindJob(db, name);
  if (!job) throw JobNotFound(name);
  return *std::move(job);
}

JobRecord SqliteJobStore::JobById(SqliteDatabase& db, int64_t job_id) {
  SqliteStatement select(db, SelectJob("where job_id=?"), job_id);
  if (!select.Step()) {
    throw Error(ErrorCode::kNotFound, "job {} was deleted", job_id);
  }
  JobRecord job = JobFromRow(select);
  job.artifacts = LoadArtifacts(db, job.id);
  return job;
}

std::vector<ArtifactRecord> SqliteJobStore::LoadArtifacts(SqliteDatabase& db, int64_t job_id) {
  return SqliteStatement(db,
                         "select name, sha256, size_bytes, media_type from artifact where job_id=? "
                         "order by name",
                         job_id)
      .All([](const SqliteStatement& row) {
        return ArtifactRecord{row.Text(0), {row.Text(1), row.Int(2)}, row.Text(3)};
      });
}

std::vector<JobRecord> SqliteJobStore::ReadJobs(SqliteDatabase& db,
                                                SqliteStatement& select,
                                                const ListBudget& budget) {
  std::vector<JobRecord> jobs;
  int64_t bytes = 0;
  while (bytes < budget.bytes && select.Step()) {
    JobRecord job = JobFromRow(select);
    if (static_cast<int64_t>(job.spec.size()) > budget.spec_bytes) job.spec = {};
    job.artifacts = LoadArtifacts(db, job.id);
    bytes += MemoryBytes(job);
    jobs.push_back(std::move(job));
  }
  return jobs;
}

std::vector<JobRecord> SqliteJobStore::GraphOf(SqliteDatabase& db, const JobRecord& root) {
  std::vector<JobRecord> jobs =
      SqliteStatement(db, SelectJobWithoutSpec("where parent=? order by job_id"), root.name)
          .All(JobFromRow);
  jobs.push_back(root);
  return jobs;
}

JobRecord SqliteJobStore::GetJob(const std::string& name) {
  const auto db = connections_.Read();
  return RequireJob(db, name);
}

std::vector<JobRecord> SqliteJobStore::ListJobs(const JobFilter& filter,
                                                int64_t before_id,
                                                int limit,
                                                const ListBudget& budget) {
  const auto db = connections_.Read();
  std::string tail = "where job_id < ?";
  if (!filter.parent.empty()) tail += " and parent=?";
  if (!filter.scene.empty()) tail += " and scene=?";
  // A parent or scene has few jobs and a project many, so the index of projects is used only
  // without a parent and scene.
  const bool is_narrow = !filter.parent.empty() || !filter.scene.empty();
  if (filter.project) tail += is_narrow ? " and +project=?" : " and project=?";
  SqliteStatement select(
      db, SelectJob(tail + " order by job_id desc limit ?"), before_id > 0 ? before_id : INT64_MAX);
  if (!filter.parent.empty()) select.Bind(filter.parent);
  if (!filter.scene.empty()) select.Bind(filter.scene);
  if (filter.project) select.Bind(*filter.project);
  select.Bind(limit);
  return ReadJobs(db, select, budget);
}

std::vector<JobRecord> SqliteJobStore::ListChildren(const std::string& name) {
  const auto db = connections_.Read();
  SqliteStatement select(db, SelectJob("where parent=? order by job_id"), name);
  return ReadJobs(db, select);
}

std::optional<std::string> SqliteJobStore::CheckRequest(SqliteDatabase& db,
                                                        const RequestKey& request) {
  if (request.id.empty()) return std::nullopt;
  SqliteStatement select(db,
                         "select body_sha256, resource from request_id where method=? and id=?",
                         request.method,
                         request.id);
  if (!select.Step()) return std::nullopt;
  if (select.Text(0) != request.body_sha256) {
    throw ServiceError(ErrorReason::kRequestIdReused,
                       "request_id '{}' was used for another {} request; choose a fresh one",
                       request.id,
                       request.method);
  }
  return select.Text(1);
}

void SqliteJobStore::RecordRequest(SqliteDatabase& db,
                                   const RequestKey& request,
                                   const std::string& resource) {
  if (request.id.empty()) return;
  db.Run("insert into request_id values(?,?,?,?,?)",
         request.method,
         request.id,
         request.body_sha256,
         resource,
         Now());
}

std::optional<std::string> SqliteJobStore::FindRequest(const RequestKey& request) {
  const auto db = connections_.Read();
  return CheckRequest(db, request);
}

int64_t SqliteJobStore::NewestRevision() {
  const auto db = connections_.Read();
  // Not max(revision): the newest event may have been deleted with its job.
  return SqliteStatement(db, "select seq from sqlite_sequence where name='job_event'").NextInt();
}

namespace {

EventRecord EventFromRow(const SqliteStatement& row) {
  return {row.Int(0),
          row.Int(1),
          row.Int(2) != 0 ? EventKind::kProgress : EventKind::kState,
          JobStateFromName(row.Text(3)),
          static_cast<int>(row.Int(4)),
          row.Int(5)};
}

}  // namespace

std::vector<EventRecord> SqliteJobStore::EventsSince(int64_t revision, int limit) {
  const auto db = connections_.Read();
  return SqliteStatement(db,
                         "select revision, job_id, progress, state, attempt, at_ms from job_event "
                         "where revision > ? order by revision limit ?",
                         revision,
                         limit)
      .All(EventFromRow);
}

std::vector<EventRecord> SqliteJobStore::EventsSince(int64_t revision,
                                                     const std::vector<int64_t>& job_ids,
                                                     int limit) {
  const auto db = connections_.Read();
  SqliteStatement bounds(db,
                         "select (select value from meta where name='compacted_revision'), "
                         "coalesce((select seq from sqlite_sequence where name='job_event'), 0)");
  bounds.Step();
  if (revision < bounds.Int(0) || revision > bounds.Int(1)) {
    throw ServiceError(ErrorReason::kRevisionCompacted,
                       "events after revision {} are not kept (kept: {} to {}); get the jobs again "
                       "and watch from revision 0",
                       revision,
                       bounds.Int(0),
                       bounds.Int(1));
  }
  return SqliteStatement(db,
                         "select revision, job_id, progress, state, attempt, at_ms from job_event "
                         "where job_id in (" +
                             JoinIds(job_ids) + ") and revision > ? order by revision limit ?",
                         revision,
                         limit)
      .All(EventFromRow);
}

bool SqliteJobStore::AllFinished(const std::vector<int64_t>& job_ids) {
  const auto db = connections_.Read();
  return !SqliteStatement(
              db,
              "select 1 from job where end_ms=0 and job_id in (" + JoinIds(job_ids) + ") limit 1")
              .Step();
}

JobsSnapshot SqliteJobStore::Snapshot(const std::vector<int64_t>& job_ids) {
  const auto db = connections_.Read();
  JobsSnapshot snapshot;
  snapshot.revision =
      SqliteStatement(db, "select seq from sqlite_sequence where name='job_event'").NextInt();
  snapshot.jobs =
      SqliteStatement(
          db, SelectJobWithoutSpec("where job_id in (" + JoinIds(job_ids) + ") order by revision"))
          .All(JobFromRow);
  return snapshot;
}

LoadedJobs SqliteJobStore::LoadJobs(const std::vector<int64_t>& job_ids, const ListBudget& budget) {
  const auto db = connections_.Read();
  LoadedJobs loaded;
  int64_t bytes = 0;
  for (; loaded.looked_for < job_ids.size() && bytes < budget.bytes; ++loaded.looked_for) {
    SqliteStatement select(db, SelectJob("where job_id=?"), job_ids[loaded.looked_for]);
    for (JobRecord& job : ReadJobs(db, select, budget)) {
      bytes += MemoryBytes(job);
      loaded.jobs.push_back(std::move(job));
    }
  }
  return loaded;
}

std::vector<int64_t> SqliteJobStore::ResolveWatch(const std::vector<std::string>& names) {
  const auto db = connections_.Read();
  std::set<int64_t> ids;
  for (const std::string& name : names) {
    SqliteStatement select(db, "select job_id from job where name=?1 or parent=?1", name);
    if (!select.Step()) throw JobNotFound(name);
    do {
      ids.insert(select.Int(0));
    } while (select.Step());
  }
  return {ids.begin(), ids.end()};
}

JobCounts SqliteJobStore::CountJobs() {
  const auto db = connections_.Read();
  SqliteStatement select(
      db,
      "select coalesce(sum(state in('QUEUED','BLOCKED')),0), coalesce(sum(state='RUNNING'),0), "
      "coalesce(sum(state='BLOCKED'),0), "
      "coalesce(min(case when queued_since_ms>0 then queued_since_ms end),0), "
      "(select count(*) from notification) from job where end_ms=0");
  select.Step();
  return {select.Int(0), select.Int(1), select.Int(2), select.Int(3), select.Int(4)};
}

void SqliteJobStore::UpdateWorker(const WorkerRecord& worker) {
  WriteTransaction db(connections_, /*durable=*/false);
  db.Run(
      "insert into worker values(?,?,?,?,?) on conflict(worker_id) do update set "
      "pid=excluded.pid, job=excluded.job, memory_bytes=excluded.memory_bytes, "
      "heartbeat_ms=excluded.heartbeat_ms",
      worker.worker_id,
      worker.pid,
      worker.job,
      worker.memory_bytes,
      Now());
  db.Commit();
}

void SqliteJobStore::RemoveWorker(const std::string& worker_id) {
  WriteTransaction db(connections_, /*durable=*/false);
  db.Run("delete from worker where worker_id=?", worker_id);
  db.Commit();
}

std::vector<WorkerRecord> SqliteJobStore::ListWorkers() {
  const auto db = connections_.Read();
  return SqliteStatement(db,
                         "select worker_id, pid, job, memory_bytes, heartbeat_ms from worker order "
                         "by worker_id")
      .All([](const SqliteStatement& row) {
        return WorkerRecord{row.Text(0), row.Int(1), row.Text(2), row.Int(3), row.Int(4)};
      });
}

int64_t SqliteJobStore::RunningEpoch(const std::string& job_name) {
  const auto db = connections_.Read();
  return SqliteStatement(
             db, "select lease_epoch from job where name=? and state='RUNNING'", job_name)
      .NextInt();
}

}  // namespace color3d
