// Chores of the server: probe for writing, age limits, referenced blobs.
#include <fmt/core.h>

#include <algorithm>

#include "core/base/error.h"
#include "server/store/sqlite_db.h"
#include "server/store/sqlite_job_store.h"

namespace color3d {

bool SqliteJobStore::IsFull() {
  try {
    WriteTransaction db(connections_, /*durable=*/false);
    db.Exec("insert into meta values('probe', 0) on conflict(name) do update set value=value+1");
    db.Commit();
    return false;
  } catch (const Error& e) {
    return e.code() == ErrorCode::kResourceExhausted;
  }
}

namespace {
constexpr int kCompactAtOnce = 200;
}

// Works in steps from the oldest to the first young event, so that other writers do not wait long.
void SqliteJobStore::Compact(int64_t events_before_ms, int64_t requests_before_ms) {
  for (std::optional<int64_t> revision = 0; revision;) {
    revision = CompactEvents(*revision, events_before_ms);
  }
  requests_before_ms = std::min(requests_before_ms, RecordedRequestAge(requests_before_ms));
  int64_t removed = kCompactAtOnce;
  while (removed == kCompactAtOnce) {
    WriteTransaction db(connections_, /*durable=*/false);
    removed = db.Run(
        "delete from request_id where (method, id) in (select method, id from request_id where "
        "at_ms<? order by at_ms limit ?)",
        requests_before_ms,
        kCompactAtOnce);
    db.Commit();
  }
}

int64_t SqliteJobStore::RecordedRequestAge(int64_t before_ms) {
  constexpr int64_t kDayMs = 24 * 3'600'000;
  WriteTransaction db(connections_, /*durable=*/false);
  db.Run("update meta set value=value+? where name='requests_age_ms'",
         ElapsedSinceLast(db, "requests_steady_ms"));
  SqliteStatement due(db,
                      "select n.value from meta n, meta a where n.name='requests_noted_ms' and "
                      "a.name='requests_age_ms' and a.value>=?",
                      kDayMs);
  int64_t noted = 0;
  if (due.Step()) {
    noted = due.Int(0);
    db.Run("update meta set value=? where name='requests_noted_ms'", before_ms);
    db.Run("update meta set value=0 where name='requests_age_ms'");
  }
  db.Commit();
  return noted;
}

std::optional<int64_t> SqliteJobStore::CompactEvents(int64_t after, int64_t before_ms) {
  int64_t last = 0;
  {
    const auto db = connections_.Read();
    SqliteStatement next(
        db,
        "select max(revision), max(old), max(old and ended) from (select "
        "e.revision, e.at_ms<? as old, j.end_ms<>0 as ended from job_event e cross "
        "join job j on j.job_id=e.job_id where e.revision>? order by e.revision "
        "limit ?)",
        before_ms,
        after,
        kCompactAtOnce);
    next.Step();
    if (next.Int(1) == 0) return std::nullopt;
    last = next.Int(0);
    if (next.Int(2) == 0) return last;
  }
  WriteTransaction db(connections_, /*durable=*/false);
  constexpr char kOld[] =
      " from job_event where revision>? and revision<=? and at_ms<? and "
      "exists(select 1 from job where job.job_id=job_event.job_id and end_ms<>0)";
  const int64_t newest =
      SqliteStatement(db,
                      std::string("select max(revision)") + kOld + " and progress=0",
                      after,
                      last,
                      before_ms)
          .NextInt();
  db.Run("update meta set value=max(value, ?) where name='compacted_revision'", newest);
  db.Run(std::string("delete") + kOld, after, last, before_ms);
  db.Commit();
  return last;
}

namespace {
constexpr char kReferences[] =
    "select sha256 from artifact union select sha256 from scene_file "
    "union select sha256 from job_blob "
    "union select checkpoint_sha256 from job where checkpoint_sha256 <> ''";
}  // namespace

std::set<std::string> SqliteJobStore::ReferencedBlobs() {
  const auto db = connections_.Read();
  const std::vector<std::string> digests = SqliteStatement(db, kReferences).Texts();
  return {digests.begin(), digests.end()};
}

std::set<std::string> SqliteJobStore::AwaitedBlobs() {
  const auto db = connections_.Read();
  const std::vector<std::string> digests =
      SqliteStatement(
          db,
          "select f.sha256 from scene_file f join scene s on s.scene_id=f.scene_id where "
          "s.active=0 "
          "except select f.sha256 from scene_file f join scene s on s.scene_id=f.scene_id where "
          "s.active=1 except select sha256 from artifact except select sha256 from job_blob "
          "except select checkpoint_sha256 from job where checkpoint_sha256 <> ''")
          .Texts();
  return {digests.begin(), digests.end()};
}

bool SqliteJobStore::IsReferenced(const std::string& sha256) {
  const auto db = connections_.Read();
  SqliteStatement select(
      db,
      "select exists(select 1 from artifact where sha256=?1) or "
      "exists(select 1 from scene_file where sha256=?1) or "
      "exists(select 1 from job_blob where sha256=?1) or "
      "exists(select 1 from job where checkpoint_sha256=?1 and checkpoint_sha256 <> '')",
      sha256);
  select.Step();
  return select.Int(0) != 0;
}

int64_t SqliteJobStore::ElapsedSinceLast(SqliteDatabase& db, const char* name) {
  const int64_t before = SqliteStatement(db, "select value from meta where name=?", name).NextInt();
  db.Run("update meta set value=max(?, 1) where name=?", SteadyNow(), name);
  return before > 0 ? std::max<int64_t>(SteadyNow() - before, 0) : 0;
}

namespace {
std::vector<BlobCandidate> DueCandidates(SqliteDatabase& db, int64_t grace_ms) {
  return SqliteStatement(
             db, "select sha256, touched_ns from blob_candidate where age_ms>=?", grace_ms)
      .All([](const SqliteStatement& row) {
        return BlobCandidate{row.Text(0), row.Int(1)};
      });
}
}  // namespace

std::vector<BlobCandidate> SqliteJobStore::AgeCandidates(const std::vector<BlobCandidate>& unnamed,
                                                         int64_t grace_ms) {
  WriteTransaction db(connections_);
  const int64_t elapsed = ElapsedSinceLast(db, "collected_steady_ms");
  db.Exec("create temp table told(sha256 text primary key, touched_ns integer) without rowid");
  for (const BlobCandidate& blob : unnamed) {
    db.Run("insert or ignore into told values(?,?)", blob.sha256, blob.touched_ns);
  }
  db.Exec(
      "delete from blob_candidate where not exists(select 1 from told where "
      "told.sha256=blob_candidate.sha256 and told.touched_ns=blob_candidate.touched_ns)");
  db.Run("update blob_candidate set age_ms=age_ms+?", elapsed);
  db.Exec("insert or ignore into blob_candidate select sha256, touched_ns, 0 from told");
  db.Exec("drop table told");
  std::vector<BlobCandidate> due = DueCandidates(db, grace_ms);
  db.Commit();
  return due;
}

std::vector<BlobCandidate> SqliteJobStore::AgedCandidates(int64_t grace_ms) {
  return DueCandidates(connections_.Read(), grace_ms);
}

// Works in steps with a short log: a nearly full disk has no room for a long one.
int64_t SqliteJobStore::ReturnFreeSpace(int64_t keep_bytes) {
  constexpr int64_t kPagesAtOnce = 500;
  const SqliteConnections::Writer writer(connections_);
  SqliteDatabase& db = *writer;
  const auto number = [&](const char* pragma) { return SqliteStatement(db, pragma).NextInt(); };
  const int64_t page_bytes = number("pragma page_size");
  const int64_t keep = keep_bytes / page_bytes;
  int64_t free = number("pragma freelist_count");
  for (int step = 0; step < 4 && free > keep; ++step) {
    db.Run(fmt::format("pragma incremental_vacuum({})", std::min(kPagesAtOnce, free - keep)));
    // The checkpoint truncates the file; concurrent readers delay it.
    db.Run("pragma wal_checkpoint(passive)");
    free = number("pragma freelist_count");
  }
  return free * page_bytes;
}

}  // namespace color3d
