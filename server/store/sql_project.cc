// Projects and their blobs, holds of the queue, age limits, notifications.
#include <fmt/core.h>

#include <algorithm>

#include "server/store/sql_database.h"
#include "server/store/sql_job_store.h"
#include "server/store/sql_rows.h"

namespace color3d {
namespace {

const char* NameOf(Hold hold) { return hold == Hold::kPaused ? "hold_paused" : "hold_storage"; }

// All columns of a project.
std::string SelectProject(const SqlDatabase& db, const char* tail) {
  return fmt::format(
      "select name, bytes, (select count(*) from job where end_ms=0 and {}job.project="
      "project.name), row_bytes, scenes, uncommitted, weight from project {}",
      db.dialect().unindexed,
      tail);
}

ProjectRecord ProjectFromRow(const SqlStatement& row) {
  return {row.Text(0),
          row.Int(1),
          row.Int(2),
          row.Int(3),
          row.Int(4),
          row.Int(5),
          static_cast<int>(row.Int(6))};
}

// Returns whether workers are idle and only busy ones have this much memory.
bool NeedsBusyWorker(SqlDatabase& db, int64_t bytes) {
  SqlStatement workers(db,
                       "select coalesce(max(case when job='' then memory_limit_bytes end), 0), "
                       "coalesce(max(memory_limit_bytes), 0) from worker where "
                       "memory_limit_bytes>0");
  if (!workers.Step()) return false;
  const int64_t idle = workers.Int(0), any = workers.Int(1);
  return idle > 0 && idle < bytes && any > idle;
}

struct WaitingJob {
  int64_t priority = 0, job_id = 0, run_after_ms = 0;
  bool has_equal_work = false;  // in a running job
  int64_t needs_memory_bytes = 0;
};

// The job itself; of a submitted job whose stages all wait, its first stage.
std::optional<WaitingJob> FirstWaiting(SqlDatabase& db, const JobRecord& job) {
  if (job.state != JobState::kQueued && job.state != JobState::kBlocked) return std::nullopt;
  SqlStatement first(
      db,
      "select priority, job_id, run_after_ms, joins_key, needs_memory_bytes from job where "
      "(name=?1 or parent=?1) and state='QUEUED' and not exists(select 1 from job where "
      "parent=?1 and state='RUNNING') "
      "order by priority, job_id limit 1",
      job.name);
  if (!first.Step()) return std::nullopt;
  return WaitingJob{.priority = first.Int(0),
                    .job_id = first.Int(1),
                    .run_after_ms = first.Int(2),
                    .has_equal_work = !first.Text(3).empty(),
                    .needs_memory_bytes = first.Int(4)};
}

// `now_ms`: of the clock of retries.
std::string ReasonOfWait(SqlDatabase& db, const WaitingJob& job, int64_t now_ms) {
  SqlStatement holds(db,
                     "select name from meta where name in('hold_paused','hold_storage') and "
                     "value<>0 order by name limit 1");
  if (holds.Step()) {
    return holds.Text(0) == NameOf(Hold::kPaused)
               ? "the operator, who has paused the queue"
               : "space on the server's disk, which is nearly full";
  }
  if (!SqlStatement(db, "select 1 from worker limit 1").Step()) return "a worker; none is running";
  const int64_t pause_ms = job.run_after_ms - now_ms;
  if (pause_ms > 0) return fmt::format("its next attempt, in {} s", (pause_ms + 999) / 1000);
  if (job.has_equal_work) return "a running job with equal work";
  if (NeedsBusyWorker(db, job.needs_memory_bytes)) {
    return fmt::format("a worker with {} MiB of memory; the idle ones have less",
                       job.needs_memory_bytes >> 20);
  }
  return "";
}

}  // namespace

std::vector<ProjectRecord> SqlJobStore::ListProjects() {
  return connections_->Read([&](SqlDatabase& db) -> std::vector<ProjectRecord> {
    return SqlStatement(db, SelectProject(db, "order by name")).All(ProjectFromRow);
  });
}

ProjectRecord SqlJobStore::GetProject(const std::string& name) {
  return connections_->Read([&](SqlDatabase& db) -> ProjectRecord {
    SqlStatement select(db, SelectProject(db, "where name=?"), name);
    return select.Step() ? ProjectFromRow(select) : ProjectRecord{name};
  });
}

ProjectRecord SqlJobStore::SetProjectWeight(const std::string& name, int weight) {
  return connections_->Write([&](SqlDatabase& db) -> ProjectRecord {
    db.Run("insert into project(name) values(?) on conflict do nothing", name);
    db.Run("update project set weight=? where name=?", weight, name);
    SqlStatement select(db, SelectProject(db, "where name=?"), name);
    select.Step();
    return ProjectFromRow(select);
  });
}

void SqlJobStore::HoldBlob(const std::string& project, const FileDigest& blob) {
  if (!HeldBlobs(project, {blob.sha256}).empty()) return;
  connections_->Write([&](SqlDatabase& db) {
    db.Run("insert into blob_holding values(?,?,?) on conflict do nothing",
           project,
           blob.sha256,
           blob.size_bytes);
  });
}

std::set<std::string> SqlJobStore::HeldBlobs(const std::string& project,
                                             const std::vector<std::string>& sha256) {
  return connections_->Read([&](SqlDatabase& db) -> std::set<std::string> {
    std::set<std::string> known;
    for (const std::string& digest : sha256) {
      if (SqlStatement(
              db, "select 1 from blob_holding where project=? and sha256=?", project, digest)
              .Step()) {
        known.insert(digest);
      }
    }
    return known;
  });
}

void SqlJobStore::ForgetBlob(const std::string& sha256) {
  connections_->Write([&](SqlDatabase& db) {
    // Equal bytes may have been stored and named again since.
    db.Run(
        "delete from blob_holding where sha256=?1 and not exists(select 1 from artifact where "
        "sha256=?1) and not exists(select 1 from scene_file where sha256=?1) and not exists(select "
        "1 "
        "from job_blob where sha256=?1)",
        sha256);
  });
}

void SqlJobStore::ReleaseHoldings(SqlDatabase& db,
                                  const std::string& project,
                                  const std::vector<std::string>& sha256) {
  for (const std::string& digest : sha256) {
    db.Run(
        "delete from blob_holding where project=?1 and sha256=?2 and not exists("
        "select 1 from artifact n join job j on j.job_id=n.job_id "
        "where n.sha256=?2 and j.project=?1) and not exists("
        "select 1 from job_blob n join job j on j.job_id=n.job_id "
        "where n.sha256=?2 and j.project=?1) and not exists("
        "select 1 from scene_file n join scene s on s.scene_id=n.scene_id "
        "where n.sha256=?2 and s.project=?1)",
        project,
        digest);
  }
}

void SqlJobStore::SetHold(Hold hold, bool on) {
  connections_->Write(
      [&](SqlDatabase& db) { db.Run("update meta set value=? where name=?", on, NameOf(hold)); });
}

std::set<Hold> SqlJobStore::Holds() {
  return connections_->Read([&](SqlDatabase& db) -> std::set<Hold> {
    std::set<Hold> holds;
    for (const Hold hold : {Hold::kPaused, Hold::kStorage}) {
      if (SqlStatement(db, "select 1 from meta where name=? and value<>0", NameOf(hold)).Step()) {
        holds.insert(hold);
      }
    }
    return holds;
  });
}

std::vector<JobRecord> SqlJobStore::ListQueue(int max_waiting) {
  constexpr int kMaxListed = 1000;
  return connections_->Read([&](SqlDatabase& db) -> std::vector<JobRecord> {
    std::vector<JobRecord> jobs =
        SqlStatement(
            db,
            SelectJobWithoutSpec("where state='RUNNING' order by start_ms, job_id limit ?"),
            kMaxListed)
            .All(JobFromRow);
    // The k-th job of a project has the project's turn after k claims.
    SqlStatement next(db,
                      "select job_id from (select job_id, priority, project, row_number() over("
                      "partition by project, priority order by deadline_ms, job_id) as k from job "
                      "where state='QUEUED') q join "
                      "project p on p.name=q.project order by priority, turn+k*?/weight, job_id "
                      "limit ?",
                      kProjectTurn,
                      std::min(max_waiting, kMaxListed));
    for (const int64_t id : next.All([](const SqlStatement& row) { return row.Int(0); })) {
      SqlStatement select(db, SelectJobWithoutSpec("where job_id=?"), id);
      if (select.Step()) jobs.push_back(JobFromRow(select));
    }
    return jobs;
  });
}

QueuePlace SqlJobStore::PlaceInQueue(const JobRecord& job) {
  return connections_->Read([&](SqlDatabase& db) -> QueuePlace {
    const std::optional<WaitingJob> first = FirstWaiting(db, job);
    if (!first) return {};
    SqlStatement before(db,
                        "select count(*) from job where state='QUEUED' and "
                        "(priority, job_id)<(?, ?)",
                        first->priority,
                        first->job_id);
    return {.position = 1 + before.NextInt(), .waits_for = ReasonOfWait(db, *first, SteadyNow(db))};
  });
}

std::string SqlJobStore::WaitsFor(const JobRecord& job) {
  return connections_->Read([&](SqlDatabase& db) -> std::string {
    const std::optional<WaitingJob> first = FirstWaiting(db, job);
    return first ? ReasonOfWait(db, *first, SteadyNow(db)) : "";
  });
}

std::vector<std::string> SqlJobStore::AgeExpired(int64_t ended_before_ms, int64_t grace_ms) {
  return connections_->Write([&](SqlDatabase& db) -> std::vector<std::string> {
    constexpr char kExpired[] =
        "select job_id from job where parent='' and end_ms<>0 and pinned=0 and end_ms<? and "
        "not exists(select 1 from job member join job_dependency d on d.input_id=member.job_id "
        "join job reader on reader.job_id=d.job_id where (member.job_id=job.job_id or "
        "member.parent=job.name) and reader.end_ms=0)";
    const int64_t elapsed = ElapsedSinceLast(db, "expiry_steady_ms");
    db.Run(std::string("delete from expiry_candidate where job_id not in (") + kExpired + ")",
           ended_before_ms);
    db.Run("update expiry_candidate set age_ms=age_ms+?", elapsed);
    db.Run(std::string("insert into expiry_candidate select job_id, 0 from (") + kExpired +
               ") as expired where true on conflict do nothing",
           ended_before_ms);
    std::vector<std::string> due =
        SqlStatement(db,
                     "select job.name from expiry_candidate e join job on "
                     "job.job_id=e.job_id where e.age_ms>=? order by e.job_id limit 1000",
                     grace_ms)
            .Texts();
    return due;
  });
}

std::vector<std::string> SqlJobStore::AgeUnusedScenes(int64_t before_ms,
                                                      int64_t uncommitted_before_ms,
                                                      int64_t grace_ms) {
  // Only committed scenes have jobs.
  constexpr char kUnused[] =
      "((active=0 and create_ms<?2) or (create_ms<?1 and commit_ms<?1 and not exists("
      "select 1 from job where job.scene=scene.name)))";
  return connections_->Write([&](SqlDatabase& db) -> std::vector<std::string> {
    db.Run("update scene set unused_age_ms=unused_age_ms+? where unused_age_ms>=0",
           ElapsedSinceLast(db, "scenes_steady_ms"));
    db.Run(
        std::string("update scene set unused_age_ms=-1 where unused_age_ms>=0 and not ") + kUnused,
        before_ms,
        uncommitted_before_ms);
    db.Run(std::string("update scene set unused_age_ms=0 where unused_age_ms<0 and ") + kUnused,
           before_ms,
           uncommitted_before_ms);
    std::vector<std::string> due =
        SqlStatement(db,
                     "select name from scene where unused_age_ms>=? order by scene_id limit 1000",
                     grace_ms)
            .Texts();
    return due;
  });
}

namespace {
constexpr int64_t kLongestPauseMs = 3'600'000;  // a longer pause means that the clock was set
}

std::vector<Notification> SqlJobStore::DueNotifications(int of_each_receiver) {
  return connections_->Read([&](SqlDatabase& db) -> std::vector<Notification> {
    // The receiver is the part of the address before its third slash.
    return SqlStatement(
               db,
               fmt::format("select n.job_id, job.name, n.url, n.tries, n.first_ms from (select *, "
                           "row_number() over(partition by case {0}(substr(url, 9), '/') when 0 "
                           "then url else substr(url, 1, {0}(substr(url, 9), '/')+7) end order by "
                           "next_ms, job_id) as place from notification where next_ms<=? or "
                           "next_ms>?) n join job on job.job_id=n.job_id where n.place<=? order by "
                           "n.next_ms, n.job_id",
                           db.dialect().position),
               Now(db),
               Now(db) + kLongestPauseMs,
               of_each_receiver)
        .All([](const SqlStatement& row) {
          return Notification{
              row.Int(0), row.Text(1), row.Text(2), static_cast<int>(row.Int(3)), row.Int(4)};
        });
  });
}

void SqlJobStore::EndNotification(int64_t job_id, int64_t first_ms) {
  connections_->Write([&](SqlDatabase& db) {
    db.Run("delete from notification where job_id=? and first_ms=?", job_id, first_ms);
  });
}

void SqlJobStore::DelayNotification(int64_t job_id, int64_t first_ms, int64_t pause_ms) {
  connections_->Write([&](SqlDatabase& db) {
    db.Run("update notification set tries=tries+1, next_ms=? where job_id=? and first_ms=?",
           Now(db) + pause_ms,
           job_id,
           first_ms);
  });
}

}  // namespace color3d
