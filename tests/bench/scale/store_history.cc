#include "tests/bench/scale/store_history.h"

#include <fmt/format.h>

#include "core/base/error.h"
#include "server/store/postgresql/postgresql_db.h"
#include "server/store/postgresql/postgresql_job_store.h"
#include "server/store/sqlite_db.h"
#include "server/store/sqlite_job_store.h"

namespace color3d {
namespace {

constexpr char kQueuedScene[] = "scenes/queued";

// The rows n(i) = 1, 2, ... `rows`, before a select.
std::string NumberedRows(int64_t rows) {
  return fmt::format("with recursive n(i) as (select 1 union all select i+1 from n where i<{}) ",
                     rows);
}

// A different text for each row of n, `zeros` and 16 digits long.
std::string NumberText(int zeros, const char* first_digit = "1") {
  return fmt::format("'{}'||({}000000000000000+i)", std::string(zeros, '0'), first_digit);
}

}  // namespace

StoreWithHistory::StoreWithHistory(const std::filesystem::path& folder, bool in_postgresql) {
  if (!in_postgresql) {
    const std::filesystem::path file = folder / "jobs.db";
    store_ = std::make_unique<SqliteJobStore>(file, StoreRole::kServer, SystemClocks());
    db_ = std::make_unique<SqliteDatabase>(file, SqliteAccess::kWrite);
    return;
  }
  if (!testing::PostgresqlCluster::IsInstalled()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "PostgreSQL is not installed; install its package (deploy/install-deps.sh), or "
                "measure sqlite");
  }
  // As a server of its own has them: the tests' cluster does not sync.
  cluster_ = std::make_unique<testing::PostgresqlCluster>(
      std::vector<std::string>{"fsync=on", "autovacuum=on", "shared_buffers=128MB"});
  const std::string address = cluster_->NewDatabase();
  store_ = std::make_unique<PostgresqlJobStore>(address, StoreRole::kServer, std::nullopt);
  db_ = std::make_unique<PostgresqlDatabase>(address);
}

void StoreWithHistory::Fill(int64_t finished, int64_t queued, int projects) {
  const bool in_postgresql = cluster_ != nullptr;
  const char* spec = in_postgresql ? "''::bytea" : "x''";
  const int64_t now = SystemClock()();
  SceneRecord scene;
  scene.name = kQueuedScene;
  scene.files.push_back({"images/a.png", {std::string(64, 'a'), 1'000'000}});
  store_->CreateScene(scene, {}, {});
  store_->ActivateScene(kQueuedScene, CaptureLayout::kPhotos, 1, {});
  // Triggers, which count what projects use, would take most of the time.
  if (in_postgresql) db_->Exec("set statement_timeout=0; set session_replication_role=replica");
  db_->Exec("begin");
  for (int i = 0; i < projects; ++i) {
    db_->Run("insert into project(name) values(?) on conflict do nothing", fmt::format("p{}", i));
  }
  if (finished > 0) {
    const std::string numbers = NumberedRows(finished);
    db_->Exec(fmt::format("insert into job(name, kind, scene, spec, state, stage_key, project, "
                          "create_ms, start_ms, end_ms, revision) {}select 'jobs/'||{}, "
                          "'import_scene', 'scenes/past', {}, 'SUCCEEDED', {}, 'p'||(i%{}), {}, "
                          "{}, {}, i from n",
                          numbers,
                          NumberText(0),
                          spec,
                          NumberText(48),
                          projects,
                          now,
                          now,
                          now)
                  .c_str());
    db_->Exec(fmt::format("insert into artifact(job_id, name, sha256, size_bytes, media_type) "
                          "{}select i, 'scene.json', {}, 1, 'application/json' from n",
                          numbers,
                          NumberText(48))
                  .c_str());
    db_->Exec(fmt::format("insert into job_attempt(job_id, epoch, worker, start_ms, end_ms, "
                          "outcome) {}select i, 1, 'w', {}, {}, 'SUCCEEDED' from n",
                          numbers,
                          now,
                          now)
                  .c_str());
    db_->Exec(fmt::format("insert into job_event(job_id, progress, state, attempt, at_ms) "
                          "{}select i, 0, 'SUCCEEDED', 1, {} from n",
                          numbers,
                          now)
                  .c_str());
  }
  db_->Exec(fmt::format("insert into job(name, kind, scene, spec, state, project, create_ms, "
                        "queued_since_ms) {}select 'jobs/'||{}, 'select_key_view', '{}', {}, "
                        "'QUEUED', 'p'||(i%{}), {}, {} from n",
                        NumberedRows(queued),
                        NumberText(0, "2"),
                        kQueuedScene,
                        spec,
                        projects,
                        now,
                        now)
                .c_str());
  db_->Exec("commit");
  // As autovacuum does after some minutes.
  if (in_postgresql) {
    db_->Exec("set session_replication_role=origin");
    db_->Exec("vacuum analyze");
  }
}

void StoreWithHistory::ShortenQueue(int64_t left) {
  db_->Exec("begin");
  db_->Run(
      "update job set state='SUCCEEDED', end_ms=create_ms where state='QUEUED' and job_id not in "
      "(select job_id from job where state='QUEUED' order by job_id limit ?)",
      left);
  db_->Exec("commit");
}

}  // namespace color3d
