// Projects and their blobs, holds of the queue, age limits, notifications.
#include <fmt/core.h>

#include "server/store/sqlite_db.h"
#include "server/store/sqlite_job_store.h"
#include "server/store/sqlite_rows.h"

namespace color3d {
namespace {

const char* NameOf(Hold hold) { return hold == Hold::kPaused ? "hold_paused" : "hold_storage"; }

constexpr char kProject[] =
    "select name, bytes, (select count(*) from job where end_ms=0 and "
    "+job.project=project.name), row_bytes, scenes, uncommitted from project ";

ProjectRecord ProjectFromRow(const SqliteStatement& row) {
  return {row.Text(0), row.Int(1), row.Int(2), row.Int(3), row.Int(4), row.Int(5)};
}

}  // namespace

std::vector<ProjectRecord> SqliteJobStore::ListProjects() {
  const auto db = connections_.Read();
  return SqliteStatement(db, std::string(kProject) + "order by name").All(ProjectFromRow);
}

ProjectRecord SqliteJobStore::GetProject(const std::string& name) {
  const auto db = connections_.Read();
  SqliteStatement select(db, std::string(kProject) + "where name=?", name);
  return select.Step() ? ProjectFromRow(select) : ProjectRecord{name};
}

void SqliteJobStore::HoldBlob(const std::string& project, const FileDigest& blob) {
  if (!HeldBlobs(project, {blob.sha256}).empty()) return;
  WriteTransaction db(connections_);
  db.Run("insert or ignore into blob_holding values(?,?,?)", project, blob.sha256, blob.size_bytes);
  db.Commit();
}

std::set<std::string> SqliteJobStore::HeldBlobs(const std::string& project,
                                                const std::vector<std::string>& sha256) {
  const auto db = connections_.Read();
  std::set<std::string> known;
  for (const std::string& digest : sha256) {
    if (SqliteStatement(
            db, "select 1 from blob_holding where project=? and sha256=?", project, digest)
            .Step()) {
      known.insert(digest);
    }
  }
  return known;
}

void SqliteJobStore::ForgetBlob(const std::string& sha256) {
  WriteTransaction db(connections_);
  // Equal bytes may have been stored and named again since.
  db.Run(
      "delete from blob_holding where sha256=?1 and not exists(select 1 from artifact where "
      "sha256=?1) and not exists(select 1 from scene_file where sha256=?1) and not exists(select 1 "
      "from job_blob where sha256=?1)",
      sha256);
  db.Commit();
}

void SqliteJobStore::ReleaseHoldings(SqliteDatabase& db,
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

void SqliteJobStore::SetHold(Hold hold, bool on) {
  WriteTransaction db(connections_);
  db.Run("update meta set value=? where name=?", on, NameOf(hold));
  db.Commit();
}

std::set<Hold> SqliteJobStore::Holds() {
  const auto db = connections_.Read();
  std::set<Hold> holds;
  for (const Hold hold : {Hold::kPaused, Hold::kStorage}) {
    if (SqliteStatement(db, "select 1 from meta where name=? and value<>0", NameOf(hold)).Step()) {
      holds.insert(hold);
    }
  }
  return holds;
}

QueuePlace SqliteJobStore::PlaceInQueue(const JobRecord& job) {
  if (job.state != JobState::kQueued && job.state != JobState::kBlocked) return {};
  const auto db = connections_.Read();
  // For a submitted job whose stages all wait: its first stage.
  SqliteStatement first(
      db,
      "select priority, job_id, run_after_ms, joins_key from job where (name=?1 or parent=?1) and "
      "state='QUEUED' and not exists(select 1 from job where parent=?1 and state='RUNNING') "
      "order by priority, job_id limit 1",
      job.name);
  if (!first.Step()) return {};
  QueuePlace place;
  place.position =
      1 +
      SqliteStatement(db,
                      "select count(*) from job where state='QUEUED' and (priority, job_id)<(?, ?)",
                      first.Int(0),
                      first.Int(1))
          .NextInt();
  SqliteStatement holds(db,
                        "select name from meta where name in('hold_paused','hold_storage') and "
                        "value<>0 order by name limit 1");
  const int64_t pause_ms = first.Int(2) - SteadyNow();
  if (holds.Step()) {
    place.waits_for = holds.Text(0) == NameOf(Hold::kPaused)
                          ? "the operator, who has paused the queue"
                          : "space on the server's disk, which is nearly full";
  } else if (!SqliteStatement(db, "select 1 from worker limit 1").Step()) {
    place.waits_for = "a worker; none is running";
  } else if (pause_ms > 0) {
    place.waits_for = fmt::format("its next attempt, in {} s", (pause_ms + 999) / 1000);
  } else if (!first.Text(3).empty()) {
    place.waits_for = "a running job with equal work";
  }
  return place;
}

std::vector<std::string> SqliteJobStore::AgeExpired(int64_t ended_before_ms, int64_t grace_ms) {
  WriteTransaction db(connections_);
  constexpr char kExpired[] =
      "select job_id from job where parent='' and end_ms<>0 and pinned=0 and end_ms<? and "
      "not exists(select 1 from job member join job_dependency d on d.input_id=member.job_id "
      "join job reader on reader.job_id=d.job_id where (member.job_id=job.job_id or "
      "member.parent=job.name) and reader.end_ms=0)";
  const int64_t elapsed = ElapsedSinceLast(db, "expiry_steady_ms");
  db.Run(std::string("delete from expiry_candidate where job_id not in (") + kExpired + ")",
         ended_before_ms);
  db.Run("update expiry_candidate set age_ms=age_ms+?", elapsed);
  db.Run(std::string("insert or ignore into expiry_candidate select job_id, 0 from (") + kExpired +
             ")",
         ended_before_ms);
  std::vector<std::string> due =
      SqliteStatement(db,
                      "select job.name from expiry_candidate e join job on "
                      "job.job_id=e.job_id where e.age_ms>=? order by e.job_id limit 1000",
                      grace_ms)
          .Texts();
  db.Commit();
  return due;
}

std::vector<std::string> SqliteJobStore::AgeUnusedScenes(int64_t before_ms,
                                                         int64_t uncommitted_before_ms,
                                                         int64_t grace_ms) {
  // Only committed scenes have jobs.
  constexpr char kUnused[] =
      "((active=0 and create_ms<?2) or (max(create_ms, commit_ms)<?1 and not exists("
      "select 1 from job where job.scene=scene.name)))";
  WriteTransaction db(connections_);
  db.Run("update scene set unused_age_ms=unused_age_ms+? where unused_age_ms>=0",
         ElapsedSinceLast(db, "scenes_steady_ms"));
  db.Run(std::string("update scene set unused_age_ms=-1 where unused_age_ms>=0 and not ") + kUnused,
         before_ms,
         uncommitted_before_ms);
  db.Run(std::string("update scene set unused_age_ms=0 where unused_age_ms<0 and ") + kUnused,
         before_ms,
         uncommitted_before_ms);
  std::vector<std::string> due =
      SqliteStatement(db,
                      "select name from scene where unused_age_ms>=? order by scene_id limit 1000",
                      grace_ms)
          .Texts();
  db.Commit();
  return due;
}

namespace {
constexpr int64_t kLongestPauseMs = 3'600'000;  // a longer pause means that the clock was set
}

std::vector<Notification> SqliteJobStore::DueNotifications(int of_each_receiver) {
  const auto db = connections_.Read();
  // The receiver is the part of the address before its third slash.
  return SqliteStatement(
             db,
             "select n.job_id, job.name, n.url, n.tries, n.first_ms from (select *, row_number() "
             "over("
             "partition by case instr(substr(url, 9), '/') when 0 then url else "
             "substr(url, 1, instr(substr(url, 9), '/')+7) end order by next_ms, job_id) as place "
             "from notification where next_ms<=? or next_ms>?) n join job on job.job_id=n.job_id "
             "where n.place<=? order by n.next_ms, n.job_id",
             Now(),
             Now() + kLongestPauseMs,
             of_each_receiver)
      .All([](const SqliteStatement& row) {
        return Notification{
            row.Int(0), row.Text(1), row.Text(2), static_cast<int>(row.Int(3)), row.Int(4)};
      });
}

void SqliteJobStore::EndNotification(int64_t job_id, int64_t first_ms) {
  WriteTransaction db(connections_);
  db.Run("delete from notification where job_id=? and first_ms=?", job_id, first_ms);
  db.Commit();
}

void SqliteJobStore::DelayNotification(int64_t job_id, int64_t first_ms, int64_t pause_ms) {
  WriteTransaction db(connections_);
  db.Run("update notification set tries=tries+1, next_ms=? where job_id=? and first_ms=?",
         Now() + pause_ms,
         job_id,
         first_ms);
  db.Commit();
}

}  // namespace color3d
