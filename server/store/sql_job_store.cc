// Reading and idempotency. State machine: sql_job_state.cc; calls of workers: sql_job_lease.cc;
// scenes and colorizers: sql_scene.cc; chores: sql_chores.cc.
#include "server/store/sql_job_store.h"

#include <utility>

#include "server/base/service_error.h"
#include "server/store/sql_database.h"
#include "server/store/sql_rows.h"

namespace color3d {

SqlJobStore::SqlJobStore(std::shared_ptr<SqlConnections> connections,
                         std::optional<Clocks> clocks,
                         StoreOptions options)
    : connections_(std::move(connections)),
      clocks_(std::move(clocks)),
      options_(std::move(options)) {}

SqlJobStore::~SqlJobStore() = default;

namespace {

ServiceError JobNotFound(const std::string& name) {
  return ServiceError(ErrorReason::kJobNotFound, "there is no job '{}'", name);
}

}  // namespace

std::optional<JobRecord> SqlJobStore::FindJob(SqlDatabase& db, const std::string& name) {
  SqlStatement select(db, SelectJob("where name=?"), name);
  if (!select.Step()) return std::nullopt;
  JobRecord job = JobFromRow(select);
  job.artifacts = LoadArtifacts(db, job.id);
  return job;
}

JobRecord SqlJobStore::RequireJob(SqlDatabase& db, const std::string& name) {
  std::optional<JobRecord> job = FindJob(db, name);
  if (!job) throw JobNotFound(name);
  return *std::move(job);
}

JobRecord SqlJobStore::JobById(SqlDatabase& db, int64_t job_id) {
  SqlStatement select(db, SelectJob("where job_id=?"), job_id);
  if (!select.Step()) {
    throw Error(ErrorCode::kNotFound, "job {} was deleted", job_id);
  }
  JobRecord job = JobFromRow(select);
  job.artifacts = LoadArtifacts(db, job.id);
  return job;
}

std::vector<ArtifactRecord> SqlJobStore::LoadArtifacts(SqlDatabase& db, int64_t job_id) {
  return SqlStatement(db,
                      "select name, sha256, size_bytes, media_type from artifact where job_id=? "
                      "order by name",
                      job_id)
      .All([](const SqlStatement& row) {
        return ArtifactRecord{row.Text(0), {row.Text(1), row.Int(2)}, row.Text(3)};
      });
}

std::vector<JobRecord> SqlJobStore::ReadJobs(SqlDatabase& db,
                                             SqlStatement& select,
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

std::vector<JobRecord> SqlJobStore::GraphOf(SqlDatabase& db, const JobRecord& root) {
  std::vector<JobRecord> jobs =
      SqlStatement(db, SelectJobWithoutSpec("where parent=? order by job_id"), root.name)
          .All(JobFromRow);
  jobs.push_back(root);
  return jobs;
}

JobRecord SqlJobStore::GetJob(const std::string& name) {
  return connections_->Read([&](SqlDatabase& db) -> JobRecord { return RequireJob(db, name); });
}

std::vector<JobRecord> SqlJobStore::ListJobs(const JobFilter& filter,
                                             int64_t before_id,
                                             int limit,
                                             const ListBudget& budget) {
  return connections_->Read([&](SqlDatabase& db) -> std::vector<JobRecord> {
    std::string tail = "where job_id < ?";
    if (!filter.parent.empty()) tail += " and parent=?";
    if (!filter.scene.empty()) tail += " and scene=?";
    // A parent or scene has few jobs and a project many, so the index of projects is used only
    // without a parent and scene.
    const bool is_narrow = !filter.parent.empty() || !filter.scene.empty();
    if (filter.project) {
      tail += std::string(" and ") + (is_narrow ? db.dialect().unindexed : "") + "project=?";
    }
    SqlStatement select(db,
                        SelectJob(tail + " order by job_id desc limit ?"),
                        before_id > 0 ? before_id : INT64_MAX);
    if (!filter.parent.empty()) select.Bind(filter.parent);
    if (!filter.scene.empty()) select.Bind(filter.scene);
    if (filter.project) select.Bind(*filter.project);
    select.Bind(limit);
    return ReadJobs(db, select, budget);
  });
}

std::vector<JobRecord> SqlJobStore::ListChildren(const std::string& name) {
  return connections_->Read([&](SqlDatabase& db) -> std::vector<JobRecord> {
    SqlStatement select(db, SelectJob("where parent=? order by job_id"), name);
    return ReadJobs(db, select);
  });
}

std::optional<std::string> SqlJobStore::CheckRequest(SqlDatabase& db, const RequestKey& request) {
  if (request.id.empty()) return std::nullopt;
  SqlStatement select(db,
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

void SqlJobStore::RecordRequest(SqlDatabase& db,
                                const RequestKey& request,
                                const std::string& resource) {
  if (request.id.empty()) return;
  db.Run("insert into request_id values(?,?,?,?,?)",
         request.method,
         request.id,
         request.body_sha256,
         resource,
         Now(db));
}

std::optional<std::string> SqlJobStore::FindRequest(const RequestKey& request) {
  return connections_->Read(
      [&](SqlDatabase& db) -> std::optional<std::string> { return CheckRequest(db, request); });
}

int64_t SqlJobStore::NewestRevision() {
  return connections_->Read([&](SqlDatabase& db) -> int64_t {
    // Not max(revision): the newest event may have been deleted with its job.
    return SqlStatement(db, db.dialect().newest_revision).NextInt();
  });
}

namespace {

EventRecord EventFromRow(const SqlStatement& row) {
  return {row.Int(0),
          row.Int(1),
          row.Int(2) != 0 ? EventKind::kProgress : EventKind::kState,
          JobStateFromName(row.Text(3)),
          static_cast<int>(row.Int(4)),
          row.Int(5)};
}

}  // namespace

std::vector<EventRecord> SqlJobStore::EventsSince(int64_t revision, int limit) {
  return connections_->Read([&](SqlDatabase& db) -> std::vector<EventRecord> {
    return SqlStatement(db,
                        "select revision, job_id, progress, state, attempt, at_ms from job_event "
                        "where revision > ? order by revision limit ?",
                        revision,
                        limit)
        .All(EventFromRow);
  });
}

std::vector<EventRecord> SqlJobStore::EventsSince(int64_t revision,
                                                  const std::vector<int64_t>& job_ids,
                                                  int limit) {
  return connections_->Read([&](SqlDatabase& db) -> std::vector<EventRecord> {
    const int64_t oldest =
        SqlStatement(db, "select value from meta where name='compacted_revision'").NextInt();
    const int64_t newest = SqlStatement(db, db.dialect().newest_revision).NextInt();
    if (revision < oldest || revision > newest) {
      throw ServiceError(
          ErrorReason::kRevisionCompacted,
          "events after revision {} are not kept (kept: {} to {}); get the jobs again "
          "and watch from revision 0",
          revision,
          oldest,
          newest);
    }
    return SqlStatement(db,
                        "select revision, job_id, progress, state, attempt, at_ms from job_event "
                        "where job_id in (" +
                            JoinIds(job_ids) + ") and revision > ? order by revision limit ?",
                        revision,
                        limit)
        .All(EventFromRow);
  });
}

bool SqlJobStore::AllFinished(const std::vector<int64_t>& job_ids) {
  return connections_->Read([&](SqlDatabase& db) -> bool {
    return !SqlStatement(
                db,
                "select 1 from job where end_ms=0 and job_id in (" + JoinIds(job_ids) + ") limit 1")
                .Step();
  });
}

JobsSnapshot SqlJobStore::Snapshot(const std::vector<int64_t>& job_ids) {
  return connections_->Read([&](SqlDatabase& db) -> JobsSnapshot {
    JobsSnapshot snapshot;
    snapshot.revision = SqlStatement(db, db.dialect().newest_revision).NextInt();
    snapshot.jobs = SqlStatement(db,
                                 SelectJobWithoutSpec("where job_id in (" + JoinIds(job_ids) +
                                                      ") order by revision"))
                        .All(JobFromRow);
    return snapshot;
  });
}

LoadedJobs SqlJobStore::LoadJobs(const std::vector<int64_t>& job_ids, const ListBudget& budget) {
  return connections_->Read([&](SqlDatabase& db) -> LoadedJobs {
    LoadedJobs loaded;
    int64_t bytes = 0;
    for (; loaded.looked_for < job_ids.size() && bytes < budget.bytes; ++loaded.looked_for) {
      SqlStatement select(db, SelectJob("where job_id=?"), job_ids[loaded.looked_for]);
      for (JobRecord& job : ReadJobs(db, select, budget)) {
        bytes += MemoryBytes(job);
        loaded.jobs.push_back(std::move(job));
      }
    }
    return loaded;
  });
}

std::vector<int64_t> SqlJobStore::ResolveWatch(const std::vector<std::string>& names) {
  return connections_->Read([&](SqlDatabase& db) -> std::vector<int64_t> {
    std::set<int64_t> ids;
    for (const std::string& name : names) {
      SqlStatement select(db, "select job_id from job where name=?1 or parent=?1", name);
      if (!select.Step()) throw JobNotFound(name);
      do {
        ids.insert(select.Int(0));
      } while (select.Step());
    }
    return {ids.begin(), ids.end()};
  });
}

JobCounts SqlJobStore::CountJobs() {
  return connections_->Read([&](SqlDatabase& db) -> JobCounts {
    SqlStatement select(
        db,
        "select count(*) filter(where state in('QUEUED','BLOCKED')), count(*) filter(where "
        "state='RUNNING'), count(*) filter(where state='BLOCKED'), "
        "coalesce(min(case when queued_since_ms>0 then queued_since_ms end),0), "
        "(select count(*) from notification) from job where end_ms=0");
    select.Step();
    return {select.Int(0), select.Int(1), select.Int(2), select.Int(3), select.Int(4)};
  });
}

std::string SqlJobStore::Qualified(const std::string& worker) const {
  const bool is_named = worker.find('@') != std::string::npos;
  return is_named || options_.server_name.empty() ? worker : worker + "@" + options_.server_name;
}

WorkerRecord SqlJobStore::AsTold(WorkerRecord worker) const {
  const std::string own = "@" + options_.server_name;
  if (options_.server_name.empty()) return worker;
  if (worker.worker_id.ends_with(own)) {
    worker.worker_id.resize(worker.worker_id.size() - own.size());
  } else {
    worker.pid = 0;
  }
  return worker;
}

void SqlJobStore::UpdateWorker(const WorkerRecord& worker) {
  connections_->WriteUnsynced([&](SqlDatabase& db) {
    WorkerRecord stored = worker;
    stored.worker_id = Qualified(worker.worker_id);
    stored.heartbeat_ms = Now(db);
    StoreWorkerRow(db, std::move(stored));
  });
}

void SqlJobStore::RemoveWorker(const std::string& worker_id) {
  connections_->WriteUnsynced([&](SqlDatabase& db) {
    db.Run("delete from worker where worker_id=?", Qualified(worker_id));
  });
}

std::vector<WorkerRecord> SqlJobStore::ListWorkers() {
  return connections_->Read([&](SqlDatabase& db) -> std::vector<WorkerRecord> {
    std::vector<WorkerRecord> workers = SelectWorkers(db);
    for (WorkerRecord& worker : workers) worker = AsTold(std::move(worker));
    return workers;
  });
}

int64_t SqlJobStore::RunningEpoch(const std::string& job_name) {
  return connections_->Read([&](SqlDatabase& db) -> int64_t {
    return SqlStatement(
               db, "select lease_epoch from job where name=? and state='RUNNING'", job_name)
        .NextInt();
  });
}

}  // namespace color3d
