// Creation and migration of the tables, stores of other versions, clocks that jump, restarts of the
// machine.
#include "server/store/store_schema.h"

#include <gtest/gtest.h>

#include <map>

#include "server/store/project_store.h"
#include "server/store/schema.h"
#include "server/store/sqlite_db.h"
#include "tests/support/service/job_store_fixture.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

class StoreSchemaTest : public JobStoreTest {
 protected:
  void OpenAsTool(const fs::path& file, const std::string& version = "") {
    StoreOptions options;
    options.program_version = version;
    SqliteJobStore(file, StoreRole::kTool, TestClocks(), options);
  }
  // Brings a store of version 1 to `version`, as a program of that version did.
  void MigrateOldTo(int version) {
    SqliteDatabase old(File(), SqliteAccess::kWrite);
    for (int from = 1; from < version; ++from) old.Exec(kMigrations[from - 1]);
    old.Run("update schema_version set version=?", version);
  }
  // Columns, indexes and triggers of all tables, each on a line.
  static std::vector<std::string> DescribeTables(const fs::path& file) {
    SqliteDatabase db(file, SqliteAccess::kRead);
    return SqlStatement(
               db,
               "select t.name||'.'||c.name||' '||lower(c.type)||' '||c.\"notnull\"||' '||"
               "coalesce(c.dflt_value, '')||' '||c.pk as line from sqlite_master t, "
               "pragma_table_info(t.name) c where t.type='table' union "
               "select type||' '||name||': '||replace(replace(sql, char(10), ''), '  ', ' ') from "
               "sqlite_master where type in('index','trigger') and sql<>'' order by line")
        .Texts();
  }
  int64_t VersionOf(const fs::path& file) {
    SqliteDatabase db(file, SqliteAccess::kWrite);
    SqlStatement version(db, "select version from schema_version");
    return version.Step() ? version.Int(0) : 0;
  }
  // Makes a store of version 1.
  void MakeOld() {
    store_.reset();
    SqliteDatabase old(File(), SqliteAccess::kWrite);
    old.Exec("pragma auto_vacuum=NONE");
    old.Exec("vacuum");
    const std::vector<std::string> triggers =
        SqlStatement(old, "select name from sqlite_master where type='trigger'").Texts();
    for (const std::string& trigger : triggers) old.Exec(("drop trigger " + trigger).c_str());
    old.Exec(
        "drop index scene_file_blob; alter table scene_file rename to newer; create table "
        "scene_file(scene_id integer not null references scene on delete cascade, path text not "
        "null, sha256 text not null, size_bytes integer not null, primary key(scene_id, path)) "
        "without rowid; create index scene_file_blob on scene_file(sha256); insert into scene_file "
        "select scene_id, path, sha256, size_bytes from newer; drop table newer; alter table scene "
        "drop column row_bytes; alter table job drop column row_bytes");
    for (const char* table : {"project", "blob_holding", "notification", "expiry_candidate"}) {
      old.Exec((std::string("drop table ") + table).c_str());
    }
    for (const char* index : {"scene_project",
                              "job_project",
                              "job_running_key",
                              "job_ended",
                              "request_id_age",
                              "job_next",
                              "job_models"}) {
      old.Exec((std::string("drop index ") + index).c_str());
    }
    for (const char* column : {"project",
                               "pinned",
                               "queued_ms",
                               "queued_since_ms",
                               "running_key",
                               "joins_key",
                               "notify_url",
                               "trace",
                               "deadline_ms",
                               "needs_memory_bytes",
                               "needs_models",
                               "batch_group",
                               "preferred_worker",
                               "preferred_until_ms"}) {
      old.Exec((std::string("alter table job drop column ") + column).c_str());
    }
    old.Exec("alter table scene drop column project");
    old.Exec("alter table scene drop column unused_age_ms");
    old.Exec("delete from meta where name<>'compacted_revision'");
    old.Exec("drop index job_unfinished");
    old.Exec("drop index job_checkpoint");
    old.Exec("drop index artifact_name");
    old.Exec("drop table server");
    old.Exec("drop table blob_candidate");
    old.Exec("alter table job drop column lost_input");
    old.Exec("alter table scene drop column key_color_job");
    old.Exec("update schema_version set version=1");
  }
};

TEST_F(StoreSchemaTest, ServerMigratesOldStoreAndKeepsCopy) {
  CreateSingle();
  const JobRecord done = ClaimOne();
  Succeed(done);
  const JobRecord running = (CreateSingle(), ClaimOne());
  CreateSingle();
  MakeOld();
  Open();
  EXPECT_EQ(ClaimOne().queued_ms, 0) << "since when it waited was not written down";
  const std::string result = store_->GetJob(done.name).artifacts[0].digest.sha256;
  EXPECT_EQ(store_->HeldBlobs("", {result}).size(), 1u) << "what was there can still be read";
  EXPECT_EQ(store_->GetProject("").stored_bytes, 4) << "a scene of 1 byte, a result of 3";
  EXPECT_EQ(store_->GetProject("").scenes, 1);
  EXPECT_GT(store_->GetProject("").row_bytes, 3 * 2048 + 512) << "three jobs and a scene";
  EXPECT_EQ(store_->GetScene("scenes/test").files.at(0).path, "a.jpg");
  EXPECT_EQ(store_->GetScene("scenes/test").key_color_job, "");
  EXPECT_EQ(StateOf(running.name), JobState::kRunning);
  EXPECT_EQ(store_->ReapExpired(), 1) << "its lease was by another clock";
  const fs::path copy = File().string() + ".v1";
  EXPECT_EQ(VersionOf(copy), 1);
  fs::remove(copy);
  Open();  // nothing to migrate
  EXPECT_FALSE(fs::exists(copy));
  EXPECT_EQ(store_->ListScenes({}, 0, 10).size(), 1u);
}

TEST_F(StoreSchemaTest, MigratesEveryEarlierVersion) {
  const std::vector<std::string> tables = DescribeTables(File());
  EXPECT_GT(tables.size(), 100u);
  for (int version = 1; version < kSchemaVersion; ++version) {
    SCOPED_TRACE(version);
    const JobRecord job = CreateSingle();
    MakeOld();
    MigrateOldTo(version);
    Open();
    EXPECT_EQ(VersionOf(File()), kSchemaVersion);
    EXPECT_EQ(DescribeTables(File()), tables);
    EXPECT_EQ(store_->GetScene("scenes/test").files.at(0).path, "a.jpg");
    EXPECT_EQ(store_->GetProject("").scenes, 1);
    const JobRecord claimed = ClaimOne();
    EXPECT_EQ(claimed.name, job.name);
    EXPECT_EQ(claimed.spec, "spec of single");
    Succeed(claimed, "result of version " + std::to_string(version));
  }
}

// A store of this version that another build wrote has exactly these tables. After a change of the
// tables raise kSchemaVersion, add a migration and only then change this digest.
TEST_F(StoreSchemaTest, TablesChangeOnlyWithTheVersion) {
  std::string text = std::to_string(kSchemaVersion);
  for (const std::string& line : DescribeTables(File())) text += "\n" + line;
  EXPECT_EQ(Sha256Hex(text), "a1c60be332a28aec2a265975dfbe0af5eb8c1b117e63bf24b4ced7fb27846d76")
      << text;
}

TEST_F(StoreSchemaTest, RefusesStoreOfNewerVersion) {
  store_.reset();
  SqliteDatabase(File(), SqliteAccess::kWrite).Exec("update schema_version set version=version+1");
  try {
    Open();
    ADD_FAILURE() << "the store was opened";
  } catch (const Error& e) {
    EXPECT_EQ(ReasonOf(e), "STORE_VERSION");
    EXPECT_NE(std::string(e.what()).find("use the program that wrote it"), std::string::npos);
  }
}

// Returns the number of free pages of the database after a checkpoint.
int64_t FreePages(const fs::path& file) {
  SqliteDatabase db(file, SqliteAccess::kWrite);
  db.Run("pragma wal_checkpoint(truncate)");
  SqlStatement free(db, "pragma freelist_count");
  return free.Step() ? free.Int(0) : -1;
}

TEST_F(StoreSchemaTest, FreePagesReturnToTheFileSystem) {
  for (const bool is_old : {false, true}) {
    SceneRecord scene;
    scene.name = "scenes/large";
    for (int i = 0; i < 5000; ++i) {
      scene.files.push_back({std::string(970, 'x') + std::to_string(i), {Sha256Hex("a"), 1}});
    }
    store_->CreateScene(scene, {}, {});
    if (is_old) {
      MakeOld();
      Open();
    }
    EXPECT_EQ(FreePages(File()), 0) << "it was built anew";
    const auto before = static_cast<int64_t>(fs::file_size(File()));
    EXPECT_LT(before, 10 << 20) << "not much more than its paths";
    store_->DeleteScene(scene.name, {});
    EXPECT_GT(FreePages(File()), 1000);
    int64_t left = 1;
    for (int i = 0; i < 10 && left > 0; ++i) left = store_->ReturnFreeSpace(0);
    EXPECT_EQ(left, 0);
    EXPECT_EQ(FreePages(File()), 0);
    EXPECT_LT(static_cast<int64_t>(fs::file_size(File())), before - (4 << 20));
  }
}

TEST_F(StoreSchemaTest, ToolsDoNotMigrate) {
  EXPECT_EQ(ReasonThrown([&] { OpenAsTool(scratch_.path() / "fresh.db"); }), "STORE_NOT_READY");
  MakeOld();
  EXPECT_EQ(ReasonThrown([&] { OpenAsTool(File()); }), "STORE_VERSION");
  EXPECT_EQ(VersionOf(File()), 1);
}

TEST_F(StoreSchemaTest, ClockChangesNeitherEndLeasesNorStallRetries) {
  const JobRecord job = (CreateSingle(), ClaimOne());
  for (const int64_t jump : {int64_t{1} << 40, -(int64_t{1} << 40)}) {
    wall_ += jump;
    EXPECT_EQ(store_->ReapExpired(), 0);
    store_->Heartbeat(LeaseOf(job), {}, {}, kLease);
    wall_ -= jump;
  }
  wall_ += int64_t{1} << 40;
  FailWith(job, ErrorCode::kUnavailable);
  wall_ -= int64_t{1} << 40;
  now_ += 1000;
  EXPECT_EQ(ClaimOne().attempt, 2);
}

TEST_F(StoreSchemaTest, RebootEndsAllLeases) {
  now_ = int64_t{1} << 40;
  const JobRecord running = (CreateSingle(), ClaimOne());
  const JobRecord waiting = (CreateSingle(), ClaimOne());
  FailWith(waiting, ErrorCode::kUnavailable);  // retried later
  store_.reset();
  now_ = 5;
  boot_id_ = "boot 2";
  Open();
  EXPECT_EQ(store_->ReapExpired(), 1);
  EXPECT_EQ(ClaimOne().name, waiting.name);
  now_ += 1000;
  EXPECT_EQ(ClaimOne().name, running.name);
}

// Like a full disk: writes fail, reads are answered.
TEST_F(StoreSchemaTest, RestartWritesNothing) {
  SqliteDatabase other(File(), SqliteAccess::kWrite);
  const SqliteTransaction held(other);
  EXPECT_EQ(ReasonThrown([&] { Open(); }), "nothing");
  EXPECT_EQ(store_->ListScenes({}, 0, 10).size(), 1u);
}

TEST_F(StoreSchemaTest, ReadsDoNotWaitForWriter) {
  const JobRecord job = CreateSingle();
  SqliteDatabase frozen(File(), SqliteAccess::kWrite);
  SqliteTransaction held(frozen);
  frozen.Exec("update job set priority=7");
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(store_->GetJob(job.name).priority, 100);
  EXPECT_EQ(store_->ListJobs({}, 0, 10, {}).size(), 1u);
  EXPECT_EQ(store_->CountJobs().queued, 1);
  // Nor do they wait for another thread that waits for it (its time-out is 10 s).
  std::thread writer([&] { ReasonThrown([&] { store_->Cancel(job.name, {}); }); });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(store_->GetJob(job.name).state, JobState::kQueued);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
  held.Commit();
  writer.join();
  EXPECT_EQ(StateOf(job.name), JobState::kCancelled);
}

// The cost of frequent calls does not depend on the number of finished jobs.
class StoreCostTest : public JobStoreTest {
 protected:
  // The store as seen by clients.
  ProjectStore Mine() { return ProjectStore(*store_, "attic"); }
  NewGraph Personalize(const std::string& scene) {
    NewGraph graph;
    graph.scene = scene;
    graph.jobs = {Job("personalize"), Job("root", {0})};
    return graph;
  }
  void AddHistory(int submissions) {
    for (int i = 0; i < submissions; ++i) {
      Mine().CreateGraph(Personalize("scenes/past"), {"CreateJob", NewId(), ""}, kNoLimit);
      Publication publication;
      publication.artifacts = {{"colorizer.c3c", {Sha256Hex(NewId()), 3}, "text/plain"}};
      store_->Publish(LeaseOf(ClaimOne()), publication);
      Succeed(ClaimOne());
    }
  }
  // Creates, runs and deletes two jobs; returns the steps of each call.
  std::map<std::string, int64_t> Costs() {
    std::map<std::string, int64_t> costs;
    const auto count = [&](const char* call, const auto& body) {
      const int64_t before = SqliteDatabase::Steps();
      body();
      costs[call] = SqliteDatabase::Steps() - before;
    };
    const ProjectStore mine = Mine();
    JobRecord root, job;
    ColorizerRecord colorizer;
    count("create", [&] { root = mine.CreateGraph(Personalize("scenes/now"), {}, kNoLimit); });
    count("counts", [&] { store_->CountJobs(); });
    count("place", [&] { mine.GetJob(root.name), store_->PlaceInQueue(root); });
    count("claim", [&] { job = ClaimOne(); });
    count("idle", [&] { store_->Claim("w", kLease); });
    count("inputs", [&] { store_->GetInputs(job.id); });
    count("heartbeat", [&] { store_->Heartbeat(LeaseOf(job), {1, 2, "x"}, {}, kLease); });
    count("checkpoint", [&] { store_->SetCheckpoint(LeaseOf(job), {Sha256Hex("c"), 1}); });
    count("referenced", [&] { store_->IsReferenced(Sha256Hex("c")); });
    count("reap", [&] { store_->ReapExpired(); });
    count("stage", [&] { store_->FindStage("key"); });
    count("join", [&] { store_->JoinEqual(LeaseOf(job), "key"); });
    Publication publication;
    publication.artifacts = {{"colorizer.c3c", {Sha256Hex(NewId()), 3}, "text/plain"}};
    count("publish", [&] { store_->Publish(LeaseOf(job), publication); });
    count("a scene's jobs", [&] { mine.ListJobs({"", "scenes/now"}, 0, 5, {}); });
    count("a job's children", [&] { mine.ListJobs({root.name, ""}, 0, 5, {}); });
    count("all jobs", [&] { mine.ListJobs({}, 0, 5, {}); });
    count("children", [&] { mine.ListChildren(root.name); });
    count("snapshot", [&] { mine.Snapshot(mine.ResolveWatch({root.name})); });
    count("events", [&] { store_->EventsSince(store_->NewestRevision() - 3, 100); });
    count("a scene's colorizers",
          [&] { colorizer = mine.ListColorizers("scenes/now", 0, 1).at(0); });
    count("all colorizers", [&] { mine.ListColorizers("", 0, 5); });
    count("colorizer", [&] { mine.GetColorizer(colorizer.digest.sha256); });
    count("usage", [&] { mine.Usage(); });
    count("cancel", [&] { mine.Cancel(root.name, {}); });
    count("retry", [&] { mine.Retry(root.name, false, {}, kNoLimit); });
    mine.Cancel(root.name, {});
    count("delete", [&] { mine.Delete(root.name, {}); });
    count("compact", [&] { store_->Compact(0, 0); });
    return costs;
  }
};

TEST_F(StoreCostTest, CostDoesNotGrowWithHistory) {
  for (const char* scene : {"scenes/past", "scenes/now"}) {
    SceneRecord record;
    record.name = scene;
    Mine().CreateScene(record, {}, {});
    Mine().ActivateScene(scene, CaptureLayout::kPhotos, 1, {});
  }
  AddHistory(40);
  const std::map<std::string, int64_t> few = Costs();
  AddHistory(120);
  for (const auto& [call, cost] : Costs()) EXPECT_LE(cost, few.at(call) * 5 / 4 + 20) << call;
}

}  // namespace
}  // namespace color3d
