// Chores of the server: probes for writing, age limits, referenced blobs.
#include <fmt/format.h>

#include <algorithm>

#include "core/base/error.h"
#include "server/store/sql_database.h"
#include "server/store/sql_job_store.h"

namespace color3d {

bool SqlJobStore::IsFull() {
  try {
    connections_->WriteUnsynced([](SqlDatabase& db) {
      db.Exec(
          "insert into meta values('probe', 0) on conflict(name) do update set "
          "value=meta.value+1");
    });
    return false;
  } catch (const Error& e) {
    return e.code() == ErrorCode::kResourceExhausted;
  }
}

namespace {
constexpr int kCompactAtOnce = 200;
}

// Works in steps from the oldest to the first young event, so that other writers do not wait long.
void SqlJobStore::Compact(int64_t events_before_ms, int64_t requests_before_ms) {
  for (std::optional<int64_t> revision = 0; revision;) {
    revision = CompactEvents(*revision, events_before_ms);
  }
  requests_before_ms = std::min(requests_before_ms, RecordedRequestAge(requests_before_ms));
  int64_t removed = kCompactAtOnce;
  while (removed == kCompactAtOnce) {
    removed = connections_->WriteUnsynced([&](SqlDatabase& db) {
      return db.Run(
          "delete from request_id where (method, id) in (select method, id from request_id where "
          "at_ms<? order by at_ms limit ?)",
          requests_before_ms,
          kCompactAtOnce);
    });
  }
}

int64_t SqlJobStore::RecordedRequestAge(int64_t before_ms) {
  constexpr int64_t kDayMs = 24 * 3'600'000;
  return connections_->WriteUnsynced([&](SqlDatabase& db) -> int64_t {
    db.Run("update meta set value=value+? where name='requests_age_ms'",
           ElapsedSinceLast(db, "requests_steady_ms"));
    SqlStatement due(db,
                     "select n.value from meta n, meta a where n.name='requests_noted_ms' and "
                     "a.name='requests_age_ms' and a.value>=?",
                     kDayMs);
    int64_t noted = 0;
    if (due.Step()) {
      noted = due.Int(0);
      db.Run("update meta set value=? where name='requests_noted_ms'", before_ms);
      db.Run("update meta set value=0 where name='requests_age_ms'");
    }
    return noted;
  });
}

std::optional<int64_t> SqlJobStore::CompactEvents(int64_t after, int64_t before_ms) {
  struct Step {
    bool young = false;  // no further event is old
    int64_t last = 0;
    bool removes = false;
  };
  const Step step = connections_->Read([&](SqlDatabase& db) -> Step {
    SqlStatement next(
        db,
        fmt::format("select max(revision), count(*) filter(where is_old), count(*) filter(where "
                    "is_old and has_ended) from (select e.revision, e.at_ms<? as is_old, "
                    "j.end_ms<>0 as has_ended from job_event e {} job j on j.job_id=e.job_id where "
                    "e.revision>? order by e.revision limit ?) as recent",
                    db.dialect().ordered_join),
        before_ms,
        after,
        kCompactAtOnce);
    next.Step();
    return {next.Int(1) == 0, next.Int(0), next.Int(2) != 0};
  });
  if (step.young) return std::nullopt;
  if (!step.removes) return step.last;
  connections_->WriteUnsynced([&](SqlDatabase& db) {
    constexpr char kOld[] =
        " from job_event where revision>? and revision<=? and at_ms<? and "
        "exists(select 1 from job where job.job_id=job_event.job_id and end_ms<>0)";
    const int64_t newest =
        SqlStatement(db,
                     std::string("select max(revision)") + kOld + " and progress=0",
                     after,
                     step.last,
                     before_ms)
            .NextInt();
    db.Run("update meta set value=?1 where name='compacted_revision' and value<?1", newest);
    db.Run(std::string("delete") + kOld, after, step.last, before_ms);
  });
  return step.last;
}

namespace {
constexpr char kReferences[] =
    "select sha256 from artifact union select sha256 from scene_file "
    "union select sha256 from job_blob "
    "union select checkpoint_sha256 from job where checkpoint_sha256 <> ''";
}  // namespace

std::set<std::string> SqlJobStore::ReferencedBlobs() {
  return connections_->Read([&](SqlDatabase& db) -> std::set<std::string> {
    const std::vector<std::string> digests = SqlStatement(db, kReferences).Texts();
    return {digests.begin(), digests.end()};
  });
}

std::set<std::string> SqlJobStore::AwaitedBlobs() {
  return connections_->Read([&](SqlDatabase& db) -> std::set<std::string> {
    const std::vector<std::string> digests =
        SqlStatement(
            db,
            "select f.sha256 from scene_file f join scene s on s.scene_id=f.scene_id where "
            "s.active=0 "
            "except select f.sha256 from scene_file f join scene s on s.scene_id=f.scene_id where "
            "s.active=1 except select sha256 from artifact except select sha256 from job_blob "
            "except select checkpoint_sha256 from job where checkpoint_sha256 <> ''")
            .Texts();
    return {digests.begin(), digests.end()};
  });
}

bool SqlJobStore::IsReferenced(const std::string& sha256) {
  return connections_->Read([&](SqlDatabase& db) -> bool {
    SqlStatement select(
        db,
        "select exists(select 1 from artifact where sha256=?1) or "
        "exists(select 1 from scene_file where sha256=?1) or "
        "exists(select 1 from job_blob where sha256=?1) or "
        "exists(select 1 from job where checkpoint_sha256=?1 and checkpoint_sha256 <> '')",
        sha256);
    select.Step();
    return select.Int(0) != 0;
  });
}

int64_t SqlJobStore::ElapsedSinceLast(SqlDatabase& db, const char* name) {
  const int64_t before = SqlStatement(db, "select value from meta where name=?", name).NextInt();
  const int64_t now = std::max<int64_t>(SteadyNow(db), 1);
  db.Run("update meta set value=? where name=?", now, name);
  return before > 0 ? std::max<int64_t>(now - before, 0) : 0;
}

namespace {
// Into the table `told`, many in one statement.
void InsertCandidates(SqlDatabase& db, const std::vector<BlobCandidate>& blobs) {
  constexpr size_t kAtOnce = 500;
  for (size_t first = 0; first < blobs.size(); first += kAtOnce) {
    const size_t count = std::min(kAtOnce, blobs.size() - first);
    const std::vector<const char*> places(count, "(?,?)");
    SqlStatement insert(
        db,
        fmt::format("insert into told values{} on conflict do nothing", fmt::join(places, ",")));
    for (size_t i = first; i < first + count; ++i) {
      insert.Bind(blobs[i].sha256, blobs[i].touched_ns);
    }
    insert.Run();
  }
}

std::vector<BlobCandidate> DueCandidates(SqlDatabase& db, int64_t grace_ms) {
  return SqlStatement(db, "select sha256, touched_ns from blob_candidate where age_ms>=?", grace_ms)
      .All([](const SqlStatement& row) {
        return BlobCandidate{row.Text(0), row.Int(1)};
      });
}
}  // namespace

std::vector<BlobCandidate> SqlJobStore::AgeCandidates(const std::vector<BlobCandidate>& unnamed,
                                                      int64_t grace_ms) {
  return connections_->Write([&](SqlDatabase& db) -> std::vector<BlobCandidate> {
    const int64_t elapsed = ElapsedSinceLast(db, "collected_steady_ms");
    db.Exec(fmt::format("create temp table told(sha256 text primary key, touched_ns bigint) {}",
                        db.dialect().keyed_table)
                .c_str());
    InsertCandidates(db, unnamed);
    db.Exec(
        "delete from blob_candidate where not exists(select 1 from told where "
        "told.sha256=blob_candidate.sha256 and told.touched_ns=blob_candidate.touched_ns)");
    db.Run("update blob_candidate set age_ms=age_ms+?", elapsed);
    db.Exec(
        "insert into blob_candidate select sha256, touched_ns, 0 from told where true on conflict "
        "do nothing");
    db.Exec("drop table told");
    std::vector<BlobCandidate> due = DueCandidates(db, grace_ms);
    return due;
  });
}

std::vector<BlobCandidate> SqlJobStore::AgedCandidates(int64_t grace_ms) {
  return connections_->Read([&](SqlDatabase& db) { return DueCandidates(db, grace_ms); });
}

}  // namespace color3d
