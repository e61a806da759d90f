// What only a PostgreSQL store does: its clock, several servers, errors of the database.
#include <gtest/gtest.h>

#include <thread>

#include "server/store/open_store.h"
#include "server/store/postgresql/postgresql_schema.h"
#include "tests/support/service/any_store_fixture.h"

namespace color3d {
namespace {
using testing::PostgresqlCluster;

TEST(StoresTest, PostgresqlIsTested) {
  if (!PostgresqlCluster::IsInstalled()) {
    GTEST_SKIP() << "NOT TESTED: the programs of PostgreSQL are missing; install postgresql-15";
  }
  EXPECT_EQ(StoresToTest().size(), 2u);
}

template <typename Body>
std::string MessageThrown(const Body& body) {
  try {
    body();
  } catch (const Error& e) {
    return e.what();
  }
  return "nothing";
}

// A store by the clock of its database.
class PostgresqlStoreTest : public JobStoreFixture, public ::testing::Test {
 protected:
  PostgresqlStoreTest() {
    if (!PostgresqlCluster::IsInstalled()) return;
    address_ = PostgresqlCluster::Shared().NewDatabase();
    Begin();
  }
  void SetUp() override {
    if (address_.empty()) GTEST_SKIP() << "NOT TESTED: the programs of PostgreSQL are missing";
  }
  std::unique_ptr<SqlJobStore> MakeStore(StoreRole role, const StoreOptions& options) override {
    return std::make_unique<PostgresqlJobStore>(address_, role, std::nullopt, options);
  }
  void Sql(const std::string& sql) { PostgresqlDatabase(address_).Exec(sql.c_str()); }
  int64_t Number(const std::string& sql) {
    PostgresqlDatabase db(address_);
    return SqlStatement(db, sql).NextInt();
  }
  static StoreOptions OfServer(const std::string& name) {
    StoreOptions options;
    options.server_name = name;
    return options;
  }

  std::string address_;
};

TEST_F(PostgresqlStoreTest, LeasesEndByTheClockOfTheDatabase) {
  const JobRecord job = CreateSingle();
  ASSERT_TRUE(store_->Claim("w", 60'000));
  EXPECT_EQ(store_->ReapExpired(), 0);
  const int64_t now = Number("select (extract(epoch from clock_timestamp())*1000)::bigint");
  const int64_t end =
      Number("select lease_expires_ms from job where job_id=" + std::to_string(job.id));
  EXPECT_GT(end, now + 30'000);
  EXPECT_LE(end, now + 60'000);
  Sql("update job set lease_expires_ms=lease_expires_ms-60001");
  EXPECT_EQ(store_->ReapExpired(), 1);
}

TEST_F(PostgresqlStoreTest, BytesAndTextSurvive) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("single")};
  graph.jobs[0].spec = std::string("\0\xff?\\x1'\n", 8);
  const JobRecord job = store_->CreateGraph(graph, {}, kNoLimit);
  EXPECT_EQ(store_->GetJob(job.name).spec, graph.jobs[0].spec);
  SceneRecord scene;
  scene.name = "scenes/other";
  scene.display_name = "Gr\xc3\xbc\xc3\x9f' \\ \"?1";
  store_->CreateScene(scene, {}, {});
  EXPECT_EQ(store_->GetScene(scene.name).display_name, scene.display_name);
  scene.name = "scenes/nul";
  scene.display_name = std::string("a\0b", 3);
  EXPECT_EQ(ReasonThrown([&] { store_->CreateScene(scene, {}, {}); }), "INVALID_ARGUMENT");
}

TEST_F(PostgresqlStoreTest, EventsWakeOtherServers) {
  const auto other = MakeStore(StoreRole::kServer, {});
  auto& waiting = dynamic_cast<PostgresqlJobStore&>(*other);
  const int64_t before = store_->NewestRevision();
  EXPECT_FALSE(waiting.WaitForEvent(before, std::chrono::milliseconds(50)));
  EXPECT_TRUE(other->EventsSince(before, 10).empty());
  std::thread writer([&] { CreateSingle(); });
  EXPECT_TRUE(waiting.WaitForEvent(before, std::chrono::seconds(60)));
  writer.join();
  EXPECT_EQ(other->EventsSince(before, 10).size(), 1u);
  EXPECT_EQ(store_->EventsSince(before, 10).size(), 1u) << "its own write, told or not";
}

TEST_F(PostgresqlStoreTest, OneServerRunsChores) {
  const auto has = [](SqlJobStore& store) {
    return dynamic_cast<PostgresqlJobStore&>(store).HasChores();
  };
  const auto within = [&](const std::function<bool()>& condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!condition() && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return condition();
  };
  EXPECT_TRUE(within([&] { return has(*store_); }));
  const auto other = MakeStore(StoreRole::kServer, {});
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_FALSE(has(*other));
  store_.reset();
  EXPECT_TRUE(within([&] { return has(*other); }));
}

TEST_F(PostgresqlStoreTest, WorkersBelongToTheirServer) {
  const auto a = MakeStore(StoreRole::kServer, OfServer("a"));
  const auto b = MakeStore(StoreRole::kServer, OfServer("b"));
  const JobRecord job = CreateSingle();
  ASSERT_TRUE(a->Claim("w-1", kLease * 100));
  a->UpdateWorker({"w-1", 1, job.name, 0, 0});
  b->UpdateWorker({"w-1", 1, "", 0, 0});
  EXPECT_EQ(store_->GetJob(job.name).worker, "w-1@a");
  const std::vector<WorkerRecord> seen = b->ListWorkers();
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[0].worker_id, "w-1@a");
  EXPECT_EQ(seen[0].pid, 0) << "a process of another machine";
  EXPECT_EQ(seen[1].worker_id, "w-1");
  EXPECT_EQ(seen[1].pid, 1);
  EXPECT_TRUE(b->ExpireLeases("w-1").empty()) << "another worker with the same id";
  EXPECT_EQ(a->ExpireLeases("w-1").size(), 1u);
  b->RemoveWorker("w-1@a");
  ASSERT_EQ(b->ListWorkers().size(), 1u) << "a worker of another server that ended with it";
  EXPECT_EQ(b->ListWorkers()[0].worker_id, "w-1");
}

TEST_F(PostgresqlStoreTest, ReadsDoNotWaitForWriter) {
  PostgresqlDatabase frozen(address_);
  frozen.BeginWrite(/*durable=*/true);
  EXPECT_EQ(store_->ListScenes({}, 0, 10).size(), 1u);
  frozen.RollBack();
}

TEST_F(PostgresqlStoreTest, RefusesTablesOfNewerVersion) {
  Sql("update schema_version set version=version+1");
  const std::string message = MessageThrown([&] { Open(); });
  EXPECT_NE(message.find("use the program that wrote them"), std::string::npos) << message;
}

TEST_F(PostgresqlStoreTest, ServersCreateTablesOnce) {
  address_ = PostgresqlCluster::Shared().NewDatabase(/*with_tables=*/false);
  EXPECT_EQ(ReasonThrown([&] { MakeStore(StoreRole::kTool, {}); }), "STORE_NOT_READY");
  std::vector<std::thread> servers;
  for (int i = 0; i < 4; ++i) {
    servers.emplace_back(
        [&] { EXPECT_EQ(ReasonThrown([&] { MakeStore(StoreRole::kServer, {}); }), "nothing"); });
  }
  for (std::thread& server : servers) server.join();
  EXPECT_EQ(Number("select version from schema_version"), kPostgresqlVersion);
}

// A published migration is never changed: add one instead, and raise kPostgresqlVersion.
TEST_F(PostgresqlStoreTest, PublishedMigrationsAreUnchanged) {
  EXPECT_EQ(Sha256Hex(kPostgresqlMigrations[0]),
            "5fd2fd7a18f0fe72098e7a1c2f793952d89dff8a838044f96b32ace3e523bc5b");
}

TEST_F(PostgresqlStoreTest, RefusesUnusableDatabases) {
  const auto open = [](const std::string& address) {
    return MessageThrown([&] { OpenStore(address, "", {}); });
  };
  const PostgresqlCluster& cluster = PostgresqlCluster::Shared();
  EXPECT_NE(open(cluster.AddressOf("none")).find("database \"none\" does not exist"),
            std::string::npos);
  const std::string unreachable = open("postgresql://me:secret@127.0.0.1:1/none");
  EXPECT_NE(unreachable.find("cannot be reached"), std::string::npos) << unreachable;
  EXPECT_EQ(unreachable.find("secret"), std::string::npos) << unreachable;
  EXPECT_NE(open("mysql://host").find("--store is 'mysql://host'"), std::string::npos);
  cluster.Run("alter database " + address_.substr(address_.rfind('/') + 1) +
              " set default_transaction_read_only=on");
  EXPECT_NE(open(address_).find("is read-only"), std::string::npos);
}

TEST(SharedJobLogsTest, LinesAreReadFromAnyOffset) {
  if (!testing::PostgresqlCluster::IsInstalled()) {
    GTEST_SKIP() << "NOT TESTED: the programs of PostgreSQL are missing";
  }
  const std::string address = testing::PostgresqlCluster::Shared().NewDatabase();
  PostgresqlJobStore a(address, StoreRole::kTool, std::nullopt);
  PostgresqlJobStore b(address, StoreRole::kTool, std::nullopt);
  SceneRecord scene;
  scene.name = "scenes/test";
  a.CreateScene(scene, {}, {});
  a.ActivateScene(scene.name, CaptureLayout::kPhotos, 1, {});
  NewGraph graph;
  graph.scene = scene.name;
  graph.jobs.resize(1);
  graph.jobs[0].kind = "single";
  const std::string job = a.CreateGraph(graph, {}, kNoLimit).name;
  a.AppendJobLog(job, "first\nsecond \u00e4\n");
  b.AppendJobLog(job, "third\n");
  const std::string whole = "first\nsecond \u00e4\nthird\n";
  for (size_t offset = 0; offset <= whole.size(); ++offset) {
    EXPECT_EQ(b.ReadJobLog(job, static_cast<int64_t>(offset), 1000), whole.substr(offset));
  }
  EXPECT_EQ(b.ReadJobLog(job, 1000, 1000), "");
  EXPECT_EQ(b.ReadJobLog("jobs/none", 0, 1000), "");
  b.AppendJobLog("jobs/none", "of no job\n");
  const std::string long_line = std::string(300'000, 'x') + "\n";
  for (int i = 0; i < 6; ++i) b.AppendJobLog(job, long_line);
  const std::string full = a.ReadJobLog(job, 0, 10'000'000);
  EXPECT_LT(full.size(), size_t{1'400'000});
  EXPECT_TRUE(full.ends_with("further lines are in the log of the worker\n"));
}

TEST(OpenStoreTest, FileIsTheDefault) {
  const ScratchFolder scratch;
  const OpenedStore opened = OpenStore("", scratch.path() / "jobs.db", {});
  EXPECT_TRUE(opened.has_chores()) << "there is no other server";
  SceneRecord scene;
  scene.name = "scenes/test";
  opened.store->CreateScene(scene, {}, {});
  opened.store->ActivateScene(scene.name, CaptureLayout::kPhotos, 1, {});
  const int64_t before = opened.store->NewestRevision();
  NewGraph graph;
  graph.scene = scene.name;
  graph.jobs.resize(1);
  graph.jobs[0].kind = "single";
  opened.store->CreateGraph(graph, {}, kNoLimit);
  EXPECT_GT(opened.store->NewestRevision(), before);
}

TEST(NetworkFileSystemTest, AreKnownByTheirType) {
  EXPECT_STREQ(NetworkFileSystem(0x6969), "NFS");
  EXPECT_STREQ(NetworkFileSystem(0xFF534D42), "SMB");
  EXPECT_STREQ(NetworkFileSystem(static_cast<int32_t>(0xFF534D42)), "SMB");
  EXPECT_EQ(NetworkFileSystem(0xEF53), nullptr) << "ext4";
  EXPECT_NO_THROW(RequireLocalFolder("/proc"));
}

}  // namespace
}  // namespace color3d
