// State machine of jobs: creation, cancellation, retries, and effects of a job's end on its
// dependants.
#include <fmt/core.h>

#include <algorithm>
#include <deque>

#include "core/base/text/utf8.h"
#include "server/base/service_error.h"
#include "server/store/sql_database.h"
#include "server/store/sql_job_store.h"
#include "server/store/sql_rows.h"

namespace color3d {
namespace {

// Maximum length of an error message, which all dependants repeat.
constexpr size_t kMaxErrorBytes = 4000;

ServiceError WrongState(const JobRecord& job, const std::string& remedy) {
  return ServiceError(
      ErrorReason::kWrongState, "{} is {}; {}", job.name, JobStateName(job.state), remedy);
}

bool CanBeRetried(const JobRecord& job) {
  return job.state == JobState::kFailed || job.state == JobState::kCancelled ||
         (job.state == JobState::kSkipped && !job.skipped_by_plan);
}

}  // namespace

void SqlJobStore::AddEvent(SqlDatabase& db, int64_t job_id, bool progress) {
  // Progress is coalesced: a job has at most one progress event, its newest.
  db.Run("delete from job_event where job_id=? and progress=1", job_id);
  const int64_t revision =
      SqlStatement(db,
                   "insert into job_event(job_id, progress, state, attempt, at_ms) select job_id, "
                   "?, state, attempt, ? from job where job_id=? returning revision",
                   progress,
                   Now(db),
                   job_id)
          .NextInt();
  db.Run("update job set revision=? where job_id=?", revision, job_id);
}

void SqlJobStore::SetState(SqlDatabase& db, int64_t job_id, JobState state) {
  const bool queued = state == JobState::kQueued;
  db.Run(
      "update job set state=?1, end_ms=?2, running_key='', "
      "joins_key=case when ?3 then joins_key else '' end, "
      "queued_ms=queued_ms+case when queued_since_ms between 1 and ?4 then ?4-queued_since_ms else "
      "0 "
      "end, "

      "queued_since_ms=case when ?3 then ?4 else 0 end, lease_expires_ms=null where job_id=?5",
      JobStateName(state),
      IsFinished(state) ? Now(db) : int64_t{0},
      queued,
      Now(db),
      job_id);
  if (IsFinished(state)) {
    db.Run(
        "insert into notification select job_id, notify_url, 0, end_ms, end_ms from job where "
        "job_id=? and notify_url<>'' on conflict(job_id) do update set url=excluded.url, tries=0, "
        "first_ms=excluded.first_ms, next_ms=excluded.next_ms",
        job_id);
  }
  AddEvent(db, job_id, /*progress=*/false);
}

bool SqlJobStore::InputsAreReady(SqlDatabase& db, int64_t job_id) {
  return !SqlStatement(
              db,
              "select 1 from job_dependency d join job i on i.job_id=d.input_id where d.job_id=? "
              "and "
              "not (i.state='SUCCEEDED' or (i.state='SKIPPED' and i.skipped_by_plan=1)) limit 1",
              job_id)
              .Step();
}

void SqlJobStore::QueueReadyDependants(SqlDatabase& db, int64_t job_id) {
  const auto dependants =
      SqlStatement(db,
                   "select d.job_id from job_dependency d join job j on j.job_id=d.job_id "
                   "where d.input_id=? and j.state='BLOCKED' order by d.job_id",
                   job_id)
          .All([](const SqlStatement& row) { return row.Int(0); });
  // The worker that has the results can run one job: the others are for all workers at once.
  bool is_first = true;
  for (const int64_t dependant : dependants) {
    if (!InputsAreReady(db, dependant)) continue;
    SetState(db, dependant, JobState::kQueued);
    if (is_first) PreferWorker(db, dependant, job_id);
    is_first = false;
  }
}

void SqlJobStore::EndFailed(SqlDatabase& db, int64_t job_id, const JobError& error) {
  db.Run("update job set error_code=?, error_reason=?, error_message=? where job_id=?",
         static_cast<int>(error.code),
         error.reason.empty() ? std::string(ErrorCodeName(error.code)) : error.reason,
         CleanUtf8(error.message, kMaxErrorBytes),
         job_id);
  SetState(db, job_id, JobState::kFailed);
  PropagateEnd(db, JobById(db, job_id));
}

void SqlJobStore::EndCancelled(SqlDatabase& db, int64_t job_id) {
  SetState(db, job_id, JobState::kCancelled);
  PropagateEnd(db, JobById(db, job_id));
}

// Direct and indirect dependants of `cause` can never run: the submitted job of the same graph ends
// like `cause`, all others are skipped.
void SqlJobStore::PropagateEnd(SqlDatabase& db, const JobRecord& cause) {
  const bool failed = cause.state == JobState::kFailed;
  const std::string why =
      failed ? " failed: " + cause.error->message : std::string(" was cancelled");
  std::deque<JobRecord> ended = {cause};
  while (!ended.empty()) {
    const JobRecord from = ended.front();
    ended.pop_front();
    const std::vector<JobRecord> waiting =
        SqlStatement(db,
                     SelectJobWithoutSpec(
                         "where state='BLOCKED' and job_id in "
                         "(select job_id from job_dependency where input_id=?) order by job_id"),
                     from.id)
            .All(JobFromRow);
    for (const JobRecord& job : waiting) {
      if (job.name != from.parent) {
        db.Run("update job set skip_reason=? where job_id=?", "input " + cause.name + why, job.id);
        SetState(db, job.id, JobState::kSkipped);
      } else if (failed) {
        db.Run("update job set error_code=?, error_reason=?, error_message=? where job_id=?",
               static_cast<int>(cause.error->code),
               cause.error->reason,
               cause.kind + " (" + cause.name + ")" + why,
               job.id);
        SetState(db, job.id, JobState::kFailed);
      } else {
        SetState(db, job.id, JobState::kCancelled);
      }
      ended.push_back(job);
    }
  }
}

namespace {

void RequireActive(const SceneRecord& scene) {
  if (scene.state == SceneState::kActive) return;
  throw ServiceError(ErrorReason::kSceneNotActive,
                     "the scene '{}' is not committed; upload its files and call CommitScene first",
                     PublicScene(scene.name));
}

}  // namespace

void SqlJobStore::InsertJob(SqlDatabase& db,
                            const NewGraph& graph,
                            size_t index,
                            const std::vector<std::string>& names,
                            std::vector<int64_t>* ids) {
  const NewJob& job = graph.jobs[index];
  const bool is_root = index + 1 == graph.jobs.size();
  const bool skipped = !job.skip_reason.empty();
  JobRecord record;
  record.name = names[index];
  record.project = graph.project;
  record.trace = graph.trace;
  if (is_root) {
    record.notify_url = graph.notify_url;
  } else {
    record.parent = names.back();
  }
  record.kind = job.kind;
  record.scene = job.scene.empty() ? graph.scene : job.scene;
  record.spec = job.spec;
  record.state = skipped ? JobState::kSkipped : JobState::kBlocked;
  record.priority = graph.priority;
  record.deadline_ms = graph.deadline_ms;
  record.needs = job.needs;
  record.max_attempts = options_.max_attempts;
  record.skip_reason = job.skip_reason;
  record.skipped_by_plan = skipped;
  record.create_ms = Now(db);
  if (skipped) record.end_ms = record.create_ms;
  record.row_bytes = RowBytes(record, job.inputs.size() + job.input_jobs.size(), job.blobs.size());
  const int64_t id = InsertJobRow(db, record);
  ids->push_back(id);
  std::set<int64_t> inputs;
  for (const int input : job.inputs) inputs.insert(ids->at(static_cast<size_t>(input)));
  for (const std::string& name : job.input_jobs) {
    const JobRecord input = RequireJob(db, name);
    if (CanBeRetried(input)) throw WrongState(input, "it cannot be an input; retry it first");
    inputs.insert(input.id);
  }
  for (const int64_t input : inputs) db.Run("insert into job_dependency values(?,?)", input, id);
  const std::set<std::string> blobs(job.blobs.begin(), job.blobs.end());
  for (const std::string& blob : blobs) db.Run("insert into job_blob values(?,?)", id, blob);
  if (!skipped && InputsAreReady(db, id)) {
    SetState(db, id, JobState::kQueued);
    PreferWorker(db,
                 id,
                 SqlStatement(db,
                              "select job_id from job where scene=? and lease_owner<>'' order by "
                              "job_id desc limit 1",
                              record.scene)
                     .NextInt());
  } else {
    AddEvent(db, id, /*progress=*/false);
  }
}

void SqlJobStore::RequireRoom(SqlDatabase& db,
                              const std::string& project,
                              int64_t jobs,
                              const QueueLimits& limits) {
  SqlStatement unfinished(
      db, "select count(*), count(*) filter(where project=?) from job where end_ms=0", project);
  unfinished.Step();
  if (unfinished.Int(0) + jobs > limits.all) {
    throw ServiceError(ErrorReason::kQueueFull,
                       "{} jobs wait or run, at most {} are allowed; try again later",
                       unfinished.Int(0),
                       limits.all);
  }
  if (unfinished.Int(1) + jobs > limits.of_project) {
    throw ServiceError(
        ErrorReason::kQuotaExceeded,
        fmt::format(
            "{} jobs of your project wait or run and {} would come, at most {} are allowed; "
            "wait for some, or cancel them",
            unfinished.Int(1),
            jobs,
            limits.of_project),
        {{"project:" + project + " unfinished_jobs",
          fmt::format("{} of {}", unfinished.Int(1), limits.of_project)}});
  }
}

JobRecord SqlJobStore::CreateGraph(const NewGraph& graph,
                                   const RequestKey& request,
                                   const QueueLimits& limits) {
  return connections_->Write([&](SqlDatabase& db) -> JobRecord {
    if (const auto resource = CheckRequest(db, request)) return RequireJob(db, *resource);
    std::set<std::string> scenes = {graph.scene};
    for (const NewJob& job : graph.jobs) {
      if (!job.scene.empty()) scenes.insert(job.scene);
    }
    for (const std::string& name : scenes) RequireActive(RequireScene(db, name, false));
    RequireRoom(db, graph.project, static_cast<int64_t>(graph.jobs.size()), limits);
    db.Run("insert into project(name) values(?) on conflict do nothing", graph.project);
    std::vector<std::string> names;
    for (size_t i = 0; i < graph.jobs.size(); ++i) names.push_back("jobs/" + NewId());
    std::vector<int64_t> ids;
    for (size_t i = 0; i < graph.jobs.size(); ++i) InsertJob(db, graph, i, names, &ids);
    RecordRequest(db, request, names.back());
    JobRecord root = RequireJob(db, names.back());
    return root;
  });
}

JobRecord SqlJobStore::Cancel(const std::string& name, const RequestKey& request) {
  return connections_->Write([&](SqlDatabase& db) -> JobRecord {
    if (const auto resource = CheckRequest(db, request)) return RequireJob(db, *resource);
    // The submitted job first: its children then find it finished and leave it alone.
    const std::vector<JobRecord> graph = GraphOf(db, RequireJob(db, name));
    const auto is_left_alone = [](const JobRecord& job) {
      return IsFinished(job.state) || job.cancel_requested;
    };
    // Nothing is recorded, because a repeated call changes nothing either.
    if (std::ranges::all_of(graph, is_left_alone)) return graph.back();
    for (auto it = graph.rbegin(); it != graph.rend(); ++it) {
      const JobRecord job = JobById(db, it->id);
      if (IsFinished(job.state) || job.cancel_requested) continue;
      db.Run("update job set cancel_requested=1 where job_id=?", job.id);
      if (job.state == JobState::kRunning) {
        AddEvent(db, job.id, /*progress=*/false);
      } else {
        SetState(db, job.id, JobState::kCancelled);
      }
    }
    for (const JobRecord& job : graph) {
      const JobRecord now = JobById(db, job.id);
      if (now.state == JobState::kCancelled && job.state != JobState::kCancelled)
        PropagateEnd(db, now);
    }
    RecordRequest(db, request, name);
    JobRecord result = RequireJob(db, name);
    return result;
  });
}

JobRecord SqlJobStore::Kill(const std::string& name) {
  return connections_->Write([&](SqlDatabase& db) -> JobRecord {
    std::vector<JobRecord> graph = GraphOf(db, RequireJob(db, name));
    // The submitted job first: its children then find it finished and leave it alone.
    std::ranges::reverse(graph);
    std::vector<int64_t> killed;
    for (const JobRecord& job : graph) {
      if (IsFinished(job.state)) continue;
      if (job.state == JobState::kRunning) FinishAttempt(db, {job.id, job.lease_epoch}, "KILLED");
      db.Run("update job set cancel_requested=1 where job_id=?", job.id);
      SetState(db, job.id, JobState::kCancelled);
      killed.push_back(job.id);
    }
    for (const int64_t id : killed) PropagateEnd(db, JobById(db, id));
    JobRecord result = RequireJob(db, name);
    return result;
  });
}

JobRecord SqlJobStore::Pin(const std::string& name, bool pinned) {
  return connections_->Write([&](SqlDatabase& db) -> JobRecord {
    const JobRecord job = RequireJob(db, name);
    if (!job.parent.empty()) {
      throw InvalidArgument("{0} is a stage of {1}; pin {1}", name, job.parent);
    }
    db.Run("update job set pinned=? where job_id=?", pinned, job.id);
    JobRecord result = RequireJob(db, name);
    return result;
  });
}

void SqlJobStore::ResetForRetry(SqlDatabase& db, const JobRecord& job, bool from_scratch) {
  SqlStatement lost(db, "select lost_input from job where job_id=?", job.id);
  if (lost.Step() && !lost.Text(0).empty()) {
    throw ServiceError(ErrorReason::kInputDeleted,
                       "{} reads results of {}, which was deleted; submit the job again",
                       job.name,
                       lost.Text(0));
  }
  SqlStatement bad(
      db,
      SelectJob("where job_id in (select input_id from job_dependency where job_id=?) and "
                "(state in('FAILED','CANCELLED') or (state='SKIPPED' and skipped_by_plan=0)) "
                "limit 1"),
      job.id);
  if (bad.Step()) {
    throw WrongState(JobFromRow(bad), "retry it before " + job.name + ", which reads its results");
  }
  db.Run(
      "update job set attempt=0, lost_attempts=0, cancel_requested=0, run_after_ms=0, "
      "error_code=null, error_reason='', error_message='', skip_reason='', warnings='' "
      "where job_id=?",
      job.id);
  db.Run("delete from notification where job_id=?", job.id);
  if (from_scratch) {
    db.Run(
        "update job set checkpoint_sha256='', checkpoint_bytes=0, progress_step=0, seconds=0 "
        "where job_id=?",
        job.id);
  }
  const bool ready = InputsAreReady(db, job.id);
  SetState(db, job.id, ready ? JobState::kQueued : JobState::kBlocked);
}

JobRecord SqlJobStore::Retry(const std::string& name,
                             bool from_scratch,
                             const RequestKey& request,
                             const QueueLimits& limits) {
  return connections_->Write([&](SqlDatabase& db) -> JobRecord {
    if (const auto resource = CheckRequest(db, request)) return RequireJob(db, *resource);
    const JobRecord job = RequireJob(db, name);
    if (!CanBeRetried(job)) throw WrongState(job, "only failed or cancelled jobs can be retried");
    RequireScene(db, job.scene, false);
    const JobRecord root = job.parent.empty() ? job : RequireJob(db, job.parent);
    const std::vector<JobRecord> graph = GraphOf(db, root);
    for (const JobRecord& member : graph) {
      if (member.state == JobState::kRunning && member.cancel_requested) {
        throw WrongState(member, "it is being cancelled; retry when it has stopped");
      }
    }
    const auto retried = std::count_if(graph.begin(), graph.end(), CanBeRetried);
    RequireRoom(db, root.project, retried, limits);
    // In order of creation, so that inputs are reset before their dependants.
    for (const JobRecord& member : graph) {
      if (CanBeRetried(member)) ResetForRetry(db, member, from_scratch);
    }
    RecordRequest(db, request, name);
    JobRecord result = RequireJob(db, name);
    return result;
  });
}

void SqlJobStore::Delete(const std::string& name, const RequestKey& request) {
  connections_->Write([&](SqlDatabase& db) {
    if (CheckRequest(db, request)) return;
    const JobRecord root = RequireJob(db, name);
    std::vector<int64_t> ids;
    for (const JobRecord& job : GraphOf(db, root)) {
      if (!IsFinished(job.state)) throw WrongState(job, "cancel it or wait for it before deleting");
      ids.push_back(job.id);
    }
    const std::string list = JoinIds(ids);
    SqlStatement reader(
        db,
        SelectJob(
            "where end_ms=0 and job_id in (select job_id from job_dependency where input_id in "
            "(" +
            list + ")) limit 1"));
    if (reader.Step()) {
      throw WrongState(JobFromRow(reader), "it reads results of " + name + ", which must stay");
    }
    db.Run(
        "update scene set key_color_job='' where key_color_job in (select name from job where "
        "job_id "
        "in (" +
        list + "))");
    // A failed dependant must not be retried without this input.
    db.Run(
        "update job set lost_input=(select i.name from job_dependency d join job i on "
        "i.job_id=d.input_id where d.job_id=job.job_id and d.input_id in (" +
        list + ") limit 1) where job_id in (select job_id from job_dependency where input_id in (" +
        list + "))");
    const std::vector<std::string> blobs =
        SqlStatement(db,
                     "select sha256 from artifact where job_id in (" + list +
                         ") union select sha256 from job_blob where job_id in (" + list + ")")
            .Texts();
    db.Run("delete from job where job_id in (" + list + ")");
    ReleaseHoldings(db, root.project, blobs);
    RecordRequest(db, request, name);
  });
}

}  // namespace color3d
