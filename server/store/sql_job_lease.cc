// Calls of workers and of the reaper. Every write of a worker is fenced by its lease epoch.
#include <fmt/core.h>

#include <algorithm>
#include <compare>

#include "core/base/text/utf8.h"
#include "server/base/service_error.h"
#include "server/store/sql_database.h"
#include "server/store/sql_job_store.h"
#include "server/store/sql_rows.h"

namespace color3d {
namespace {

// Maximum length of a progress message, which may quote a user's file.
constexpr size_t kMaxMessageBytes = 1000;

ServiceError LeaseLost(const Lease& lease) {
  return ServiceError(ErrorReason::kLeaseLost,
                      "this worker no longer holds job {} (epoch {})",
                      lease.job_id,
                      lease.epoch);
}

#ifdef COLOR3D_FENCE_OFF  // to be noticed by the chaos suite
constexpr char kHeld[] = "where job_id=? and ?<>0";
#else
constexpr char kHeld[] = "where job_id=? and lease_epoch=? and state='RUNNING'";
#endif

// ?1: now.
const std::string kClaimable =
    "where state='QUEUED' and run_after_ms<=?1 and not exists(select 1 from job r where "
    "job.joins_key<>'' and r.running_key=job.joins_key and r.running_key<>'') and "
    "not exists(select 1 from meta where meta.name in('hold_paused','hold_storage') and "
    "value<>0) ";

// Other workers may claim the first ones meanwhile.
constexpr size_t kMaxCandidates = 16;

// Workers that were silent for longer are not counted on.
constexpr int64_t kWorkerSilenceMs = 60'000;

// Sets of models (needs_models) of waiting jobs that the worker has; none if it has all.
std::vector<std::string> RunnableModelSets(SqlDatabase& db, const ClaimTerms& terms) {
  if (!terms.models) return {};
  std::vector<std::string> sets = {""};
  SqlStatement waiting(
      db, "select distinct needs_models from job where state='QUEUED' and needs_models<>''");
  while (waiting.Step()) {
    const std::string set = waiting.Text(0);
    const bool has_all = std::ranges::all_of(
        SplitLines(set), [&](const std::string& model) { return terms.models->contains(model); });
    if (has_all) sets.push_back(set);
  }
  return sets;
}

// "?5,?6,?7"
std::string Parameters(size_t first, size_t count) {
  std::string text;
  for (size_t i = 0; i < count; ++i) text += fmt::format("{}?{}", i == 0 ? "" : ",", first + i);
  return text;
}

// Neither a project nor a submitted job keeps out the jobs of another. ?4: kind.
std::string BesideOthers(size_t group_parameter) {
  return fmt::format(
      "and kind=?4 and batch_group=?{} and lost_attempts=0 and joins_key='' and not exists("
      "select 1 from job o where o.state='QUEUED' and o.kind<>?4 and o.run_after_ms<=?1 and "
      "o.joins_key='' and (o.priority, o.job_id)<(job.priority, job.job_id)) "
      "order by priority, (select count(*) from job r where r.state='RUNNING' and "
      "r.project=job.project)*100/coalesce((select weight from project where name=job.project), "
      "1), (select count(*) from job r where r.state='RUNNING' and "
      "coalesce(nullif(r.parent,''), r.name)=coalesce(nullif(job.parent,''), job.name)), job_id "
      "limit {}",
      group_parameter,
      kMaxCandidates);
}

std::vector<int64_t> FirstForBatch(SqlStatement waiting) {
  return waiting.All([](const SqlStatement& row) { return row.Int(0); });
}

// `select(rest, project)` starts a statement for waiting jobs of a project. Asking for each project
// finds its first jobs by an index, where sorting all waiting jobs would take long.
template <typename Select>
std::vector<int64_t> FirstInTurn(SqlDatabase& db, const Select& select) {
  struct Candidate {
    int64_t priority, turn, deadline_ms, id;
    // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 means the compiler's own code.
    auto operator<=>(const Candidate&) const = default;
  };
  const std::string first =
      fmt::format("and project=?4 order by priority, deadline_ms, job_id limit {}", kMaxCandidates);
  std::vector<Candidate> found;
  // Steps from one project with waiting jobs to the next by an index.
  SqlStatement projects(
      db,
      "with recursive waiting(p) as (select min(project) from job where state='QUEUED' union all "
      "select (select min(project) from job where state='QUEUED' and project>p) from waiting "
      "where p is not null) select name, turn from waiting join project on name=p");
  const auto waiting =
      projects.All([](const SqlStatement& row) { return std::pair(row.Text(0), row.Int(1)); });
  for (const auto& [project, turn] : waiting) {
    SqlStatement jobs = select(first, project);
    while (jobs.Step()) found.push_back({jobs.Int(1), turn, jobs.Int(2), jobs.Int(0)});
  }
  std::ranges::sort(found);
  std::vector<int64_t> ids;
  for (const Candidate& candidate : found) {
    if (ids.size() == kMaxCandidates) break;
    ids.push_back(candidate.id);
  }
  return ids;
}

bool IsRetryable(ErrorCode code) {
  return code == ErrorCode::kUnavailable || code == ErrorCode::kAborted;
}

}  // namespace

std::vector<int64_t> SqlJobStore::FindSuitable(const ClaimTerms& terms) {
  return connections_->Read([&](SqlDatabase& db) {
    const bool has_most_memory = !SqlStatement(db,
                                               "select 1 from worker where memory_limit_bytes>? "
                                               "and heartbeat_ms>? limit 1",
                                               terms.memory_limit_bytes,
                                               Now(db) - kWorkerSilenceMs)
                                      .Step();
    // ?2: worker; ?3: memory limit, 0: none; ?4: of the rest; then sets of models.
    std::string suits = kClaimable +
                        "and (preferred_until_ms<=?1 or preferred_worker=?2) and (?3=0 or "
                        "needs_memory_bytes<=?3) ";
    const std::vector<std::string> sets = RunnableModelSets(db, terms);
    if (terms.models) suits += fmt::format("and needs_models in({}) ", Parameters(5, sets.size()));
    const auto select = [&](const std::string& rest, const std::string& parameter) {
      SqlStatement statement(db,
                             "select job_id, priority, deadline_ms from job " + suits + rest,
                             SteadyNow(db),
                             Qualified(terms.worker),
                             has_most_memory ? int64_t{0} : terms.memory_limit_bytes,
                             parameter);
      for (const std::string& set : sets) statement.Bind(set);
      if (!terms.batch_kind.empty()) statement.Bind(terms.batch_group);
      return statement;
    };
    return terms.batch_kind.empty()
               ? FirstInTurn(db, select)
               : FirstForBatch(select(BesideOthers(5 + sets.size()), terms.batch_kind));
  });
}

std::optional<JobRecord> SqlJobStore::Claim(const ClaimTerms& terms) {
  const std::vector<int64_t> candidates = FindSuitable(terms);
  if (candidates.empty()) return std::nullopt;  // an idle worker only reads
  return connections_->Write([&](SqlDatabase& db) -> std::optional<JobRecord> {
    const std::string still_waits =
        "select job_id from job " + kClaimable + "and job_id=?2" + db.dialect().claim_lock;
    for (const int64_t id : candidates) {
      if (!SqlStatement(db, still_waits, SteadyNow(db), id).Step()) continue;
      return BeginAttempt(db, id, terms.worker, terms.lease_ms);
    }
    return std::nullopt;
  });
}

JobRecord SqlJobStore::BeginAttempt(SqlDatabase& db,
                                    int64_t id,
                                    const std::string& worker,
                                    int64_t lease_ms) {
  db.Run(
      "update job set state='RUNNING', attempt=attempt+1, lease_epoch=lease_epoch+1, "
      "lease_owner=?, lease_expires_ms=?, eta_seconds=-1, progress_message='', joins_key='', "
      "queued_ms=queued_ms+case when queued_since_ms between 1 and ?3 then ?3-queued_since_ms else "
      "0 end, queued_since_ms=0, "
      "start_ms=case when start_ms=0 then ?3 else start_ms end where job_id=?4",
      Qualified(worker),
      SteadyNow(db) + lease_ms,
      Now(db),
      id);
  // An idle project keeps the claim to one turn.
  db.Run(
      "update project set turn=?1/weight+(select case when m.newest-?1>project.turn then "
      "m.newest-?1 else project.turn end from (select max(turn) as newest from project) m) where "
      "name=(select project from job where job_id=?2)",
      kProjectTurn,
      id);
  db.Run(
      "insert into job_attempt(job_id, epoch, worker, start_ms) "
      "select job_id, lease_epoch, lease_owner, ? from job where job_id=?",
      Now(db),
      id);
  AddEvent(db, id, /*progress=*/false);
  return JobById(db, id);
}

void SqlJobStore::PreferWorker(SqlDatabase& db, int64_t job_id, int64_t earlier) {
  SqlStatement worker(db,
                      "select worker_id from worker join job e on e.job_id=? and "
                      "worker_id=e.lease_owner and (worker.job='' or (worker.job=e.name and "
                      "e.state='SUCCEEDED')) where cache_limit_bytes>0 and heartbeat_ms>?",
                      earlier,
                      Now(db) - kWorkerSilenceMs);
  if (!worker.Step()) return;
  db.Run("update job set preferred_worker=?, preferred_until_ms=? where job_id=?",
         worker.Text(0),
         SteadyNow(db) + options_.preference_ms,
         job_id);
}

std::vector<JobRecord> SqlJobStore::GetInputs(int64_t job_id) {
  return connections_->Read([&](SqlDatabase& db) -> std::vector<JobRecord> {
    SqlStatement select(
        db,
        SelectJob("where job_id in (select input_id from job_dependency where job_id=?) "
                  "order by job_id"),
        job_id);
    return ReadJobs(db, select);
  });
}

JobRecord SqlJobStore::RequireLease(SqlDatabase& db, const Lease& lease) {
  SqlStatement select(db, SelectJob(kHeld), lease.job_id, lease.epoch);
  if (!select.Step()) throw LeaseLost(lease);
  return JobFromRow(select);
}

HeartbeatReply SqlJobStore::Heartbeat(const Lease& lease,
                                      const ProgressRecord& progress,
                                      const JobUsage& usage,
                                      int64_t lease_ms) {
  return connections_->WriteUnsynced([&](SqlDatabase& db) -> HeartbeatReply {
    const JobRecord before = RequireLease(db, lease);
    const std::string message = CleanUtf8(progress.message, kMaxMessageBytes);
    db.Run(
        "update job set lease_expires_ms=?, progress_step=?, progress_total=?, progress_message=?, "
        "progress_error_name=?, progress_error_value=?, seconds=?, eta_seconds=?, warnings=? "
        "where job_id=?",
        SteadyNow(db) + lease_ms,
        progress.step,
        progress.total_steps,
        message,
        CleanUtf8(progress.error_name, kMaxMessageBytes),
        progress.error_value,
        usage.seconds,
        progress.eta_seconds,
        JoinLines(usage.warnings),
        lease.job_id);
    const bool moved = before.progress.step != progress.step ||
                       before.progress.message != message ||
                       before.progress.error_value != progress.error_value;
    if (moved) AddEvent(db, lease.job_id, /*progress=*/true);
    return {before.cancel_requested};
  });
}

HeartbeatReply SqlJobStore::Peek(const Lease& lease) {
  return connections_->Read([&](SqlDatabase& db) -> HeartbeatReply {
    return {RequireLease(db, lease).cancel_requested};
  });
}

std::optional<FileDigest> SqlJobStore::SetCheckpoint(const Lease& lease, const FileDigest& blob) {
  return connections_->Write([&](SqlDatabase& db) -> std::optional<FileDigest> {
    const JobRecord before = RequireLease(db, lease);
    db.Run("update job set checkpoint_sha256=?, checkpoint_bytes=? where job_id=?",
           blob.sha256,
           blob.size_bytes,
           lease.job_id);
    return before.checkpoint;
  });
}

void SqlJobStore::FinishAttempt(SqlDatabase& db, const Lease& lease, const char* outcome) {
  db.Run("update job_attempt set end_ms=?, outcome=? where job_id=? and epoch=?",
         Now(db),
         outcome,
         lease.job_id,
         lease.epoch);
}

void SqlJobStore::StoreUsage(SqlDatabase& db, int64_t job_id, const JobUsage& usage) {
  db.Run(
      "update job set seconds=?, eta_seconds=-1, warnings=?, "
      "peak_memory_bytes=case when peak_memory_bytes<?3 then ?3 else peak_memory_bytes end "
      "where job_id=?",
      usage.seconds,
      JoinLines(usage.warnings),
      usage.peak_memory_bytes,
      job_id);
}

bool SqlJobStore::JoinEqual(const Lease& lease, const std::string& stage_key) {
  return connections_->Write([&](SqlDatabase& db) -> bool {
    const JobRecord job = RequireLease(db, lease);
    const bool joins =
        SqlStatement(db,
                     "select 1 from job where running_key=? and running_key<>'' and job_id<>?",
                     stage_key,
                     lease.job_id)
            .Step();
    if (joins) FinishAttempt(db, lease, "JOINED");
    if (joins && job.cancel_requested) {
      EndCancelled(db, job.id);
    } else if (joins) {
      db.Run("update job set attempt=attempt-1, run_after_ms=0, joins_key=? where job_id=?",
             stage_key,
             lease.job_id);
      SetState(db, lease.job_id, JobState::kQueued);
    } else {
      db.Run("update job set running_key=? where job_id=?", stage_key, lease.job_id);
    }
    return joins;
  });
}

void SqlJobStore::Publish(const Lease& lease, const Publication& publication) {
  connections_->Write([&](SqlDatabase& db) {
    RequireLease(db, lease);
    for (const ArtifactRecord& artifact : publication.artifacts) {
      db.Run("insert into artifact values(?,?,?,?,?)",
             lease.job_id,
             artifact.name,
             artifact.digest.sha256,
             artifact.digest.size_bytes,
             artifact.media_type);
    }
    db.Run(
        "insert into blob_holding select j.project, a.sha256, a.size_bytes from artifact "
        "a join job j on j.job_id=a.job_id where a.job_id=? on conflict do nothing",
        lease.job_id);
    StoreUsage(db, lease.job_id, publication.usage);
    db.Run(
        "update job set stage_key=?, cached=?, checkpoint_sha256='', checkpoint_bytes=0, "
        "row_bytes=row_bytes+? where job_id=?",
        publication.stage_key,
        publication.cached,
        kArtifactRowBytes * static_cast<int64_t>(publication.artifacts.size()),
        lease.job_id);
    FinishAttempt(db, lease, "SUCCEEDED");
    SetState(db, lease.job_id, JobState::kSucceeded);
    QueueReadyDependants(db, lease.job_id);
  });
}

// Requeues the job with growing delays.
void SqlJobStore::Requeue(SqlDatabase& db, const JobRecord& job, bool count_as_lost) {
  const int doublings = std::clamp(job.attempt - 1, 0, 10);
  db.Run("update job set run_after_ms=?, lost_attempts=lost_attempts+? where job_id=?",
         SteadyNow(db) + (options_.retry_backoff_ms << doublings),
         count_as_lost,
         job.id);
  SetState(db, job.id, JobState::kQueued);
}

void SqlJobStore::Fail(const Lease& lease, const JobError& error, const JobUsage& usage) {
  connections_->Write([&](SqlDatabase& db) {
    const JobRecord job = RequireLease(db, lease);
    StoreUsage(db, lease.job_id, usage);
    FinishAttempt(db, lease, ErrorCodeName(error.code));
    if (job.cancel_requested && error.code == ErrorCode::kCancelled) {
      EndCancelled(db, job.id);
    } else if (IsRetryable(error.code) && job.attempt < job.max_attempts && !job.cancel_requested) {
      Requeue(db, job, /*count_as_lost=*/false);
    } else {
      EndFailed(db, job.id, error);
    }
  });
}

void SqlJobStore::Release(const Lease& lease, const JobUsage& usage) {
  connections_->Write([&](SqlDatabase& db) {
    const JobRecord job = RequireLease(db, lease);
    StoreUsage(db, lease.job_id, usage);
    FinishAttempt(db, lease, "RELEASED");
    if (job.cancel_requested) {
      EndCancelled(db, job.id);
    } else {
      db.Run("update job set attempt=attempt-1, run_after_ms=0 where job_id=?", job.id);
      SetState(db, job.id, JobState::kQueued);
    }
  });
}

std::optional<JobRecord> SqlJobStore::FindStage(const std::string& stage_key) {
  if (stage_key.empty()) return std::nullopt;
  return connections_->Read([&](SqlDatabase& db) -> std::optional<JobRecord> {
    SqlStatement select(db,
                        SelectJob("where stage_key=? and stage_key<>'' and state='SUCCEEDED' "
                                  "order by job_id desc limit 1"),
                        stage_key);
    if (!select.Step()) return std::nullopt;
    JobRecord job = JobFromRow(select);
    job.artifacts = LoadArtifacts(db, job.id);
    return job;
  });
}

int SqlJobStore::ReapExpired() {
  constexpr char kExpired[] = "where state='RUNNING' and lease_expires_ms<=? limit 50";
  const bool none = connections_->Read([&](SqlDatabase& db) {
    return !SqlStatement(db, SelectJob(kExpired), SteadyNow(db)).Step();
  });
  if (none) return 0;
  return connections_->Write([&](SqlDatabase& db) {
    const std::vector<JobRecord> expired =
        SqlStatement(db, SelectJob(kExpired), SteadyNow(db)).All(JobFromRow);
    for (const JobRecord& job : expired) EndLost(db, job);
    return static_cast<int>(expired.size());
  });
}

void SqlJobStore::EndLost(SqlDatabase& db, const JobRecord& job) {
  FinishAttempt(db, {job.id, job.lease_epoch}, "LOST");
  if (job.cancel_requested) {
    EndCancelled(db, job.id);
  } else if (job.attempt < job.max_attempts) {
    Requeue(db, job, /*count_as_lost=*/true);
  } else {
    EndFailed(db,
              job.id,
              MakeJobError(
                  ErrorReason::kWorkerLost,
                  fmt::format("the worker died or hung in each of {} attempts (last: {}); see its "
                              "log, and how much memory the job needs",
                              job.attempt,
                              job.worker)));
  }
}

std::vector<std::string> SqlJobStore::ExpireLeases(const std::string& worker) {
  return connections_->Write([&](SqlDatabase& db) -> std::vector<std::string> {
    std::vector<std::string> names =
        SqlStatement(db,
                     "update job set lease_expires_ms=0 where state='RUNNING' and "
                     "lease_owner=? returning name",
                     Qualified(worker))
            .Texts();
    return names;
  });
}

}  // namespace color3d
