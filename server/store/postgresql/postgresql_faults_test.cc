// Jobs in PostgreSQL while connections are cut in commits and the database is killed: every job
// ends, and each effect occurs once. COLOR3D_FENCE_OFF: late writes are accepted, which must be
// noticed.
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <mutex>
#include <thread>

#include "tests/support/service/any_store_fixture.h"
#include "tests/support/service/commit_cutter.h"

namespace color3d {
namespace {
using testing::CommitCutter;
using testing::PostgresqlCluster;

void SleepFor(int64_t ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

NewGraph PairOfJobs() {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs.resize(2);
  graph.jobs[0].kind = "first";
  graph.jobs[1].kind = "second";
  graph.jobs[1].inputs = {0};
  return graph;
}

void AddScene(JobStore& store) {
  SceneRecord scene;
  scene.name = "scenes/test";
  store.CreateScene(scene, {}, {});
  store.ActivateScene(scene.name, CaptureLayout::kPhotos, 0, {});
}

// The result is named after the attempt, so that a second one does not replace it.
Publication ResultOfAttempt(const JobRecord& job) {
  Publication publication;
  publication.artifacts = {
      {"result of " + std::to_string(job.lease_epoch), {Sha256Hex("r"), 1}, ""}};
  return publication;
}

class PostgresqlFaultsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!PostgresqlCluster::IsInstalled()) {
      GTEST_SKIP() << "NOT TESTED: the programs of PostgreSQL are missing; install postgresql-15";
    }
  }
  static int64_t Count(const std::string& address, const std::string& sql) {
    PostgresqlDatabase db(address);
    return SqlStatement(db, sql).NextInt();
  }
  // Returns what is wrong with `jobs` jobs that have ended.
  static std::vector<std::string> Problems(const std::string& address, int64_t jobs) {
    std::vector<std::string> problems;
    const auto require = [&](int64_t wanted, const char* sql) {
      const int64_t found = Count(address, sql);
      if (found != wanted) problems.push_back(std::string(sql) + ": " + std::to_string(found));
    };
    require(jobs, "select count(*) from job");
    require(jobs, "select count(*) from job where state='SUCCEEDED'");
    require(jobs, "select count(*) from artifact");
    require(jobs, "select count(*) from job_attempt where outcome='SUCCEEDED'");
    require(0, "select count(*) from job_attempt where end_ms=0");
    require(jobs, "select count(*) from job_event where state='SUCCEEDED'");
    require(1,
            "select (select value from meta where name='newest_revision')="
            "(select max(revision) from job_event)");
    return problems;
  }
};

#ifndef COLOR3D_FENCE_OFF
TEST_F(PostgresqlFaultsTest, EachCutCommitHasOneEffect) {
  constexpr int kPairs = 12;
  PostgresqlCluster& cluster = PostgresqlCluster::Shared();
  const std::string address = cluster.NewDatabase();
  const ScratchFolder folder;
  CommitCutter cutter(folder.path(), cluster.Socket(), /*every=*/2);
  std::string host;
  for (const char c : folder.path().string())
    host += c == '/' ? std::string("%2F") : std::string(1, c);
  const std::string cut_address =
      "postgresql://postgres@" + host + address.substr(address.rfind('/'));
  {
    PostgresqlJobStore store(cut_address, StoreRole::kServer, std::nullopt);
    AddScene(store);
    for (int i = 0; i < kPairs; ++i) store.CreateGraph(PairOfJobs(), {}, kNoLimit);
    while (const auto job = store.Claim("w", 60'000)) {
      const Lease lease{job->id, job->lease_epoch};
      store.Heartbeat(lease, {1, 2, "half"}, {}, 60'000);
      store.SetCheckpoint(lease, {Sha256Hex("c"), 1});
      EXPECT_EQ(job->attempt, 1);
      store.Publish(lease, ResultOfAttempt(*job));
    }
  }
  EXPECT_EQ(Problems(address, 2 * kPairs), std::vector<std::string>());
  EXPECT_EQ(Count(address, "select count(*) from job_attempt"), 2 * kPairs);
  EXPECT_EQ(Count(address, "select scenes from project where name=''"), 1);
  EXPECT_GT(cutter.before(), 10);
  EXPECT_GT(cutter.after(), 10);
  EXPECT_GT(cutter.during(), 10);
}

// What the database reports when its disk is full.
TEST_F(PostgresqlFaultsTest, FullDiskIsToldAndLosesNothing) {
  const std::string address = PostgresqlCluster::Shared().NewDatabase();
  PostgresqlJobStore store(address, StoreRole::kServer, std::nullopt);
  AddScene(store);
  store.CreateGraph(PairOfJobs(), {}, kNoLimit);
  PostgresqlDatabase(address).Exec(
      "create function refuse() returns trigger language plpgsql as $$ begin raise exception "
      "'could not extend file' using errcode='disk_full'; end $$; create trigger full_disk before "
      "insert on job_event for each row execute function refuse()");
  EXPECT_EQ(ReasonThrown([&] { store.Claim("w", 60'000); }), "STORAGE_FULL");
  EXPECT_EQ(store.CountJobs().queued, 2) << "reads are answered, and nothing was claimed";
  PostgresqlDatabase(address).Exec("drop trigger full_disk on job_event");
  EXPECT_EQ(store.Claim("w", 60'000).value().attempt, 1);
}

// A standby, or the rest after a failover.
TEST_F(PostgresqlFaultsTest, ReadOnlyDatabaseIsToldAndLeftAlone) {
  const std::string address = PostgresqlCluster::Shared().NewDatabase();
  PostgresqlJobStore store(address, StoreRole::kServer, std::nullopt);
  AddScene(store);
  store.CreateGraph(PairOfJobs(), {}, kNoLimit);
  PostgresqlDatabase(address).Exec(
      "create function refuse() returns trigger language plpgsql as $$ begin raise exception "
      "'read-only' using errcode='read_only_sql_transaction'; end $$; create trigger standby "
      "before "
      "insert on job_event for each row execute function refuse()");
  EXPECT_EQ(ReasonThrown([&] { store.Claim("w", 60'000); }), "STORE_NOT_WRITABLE");
  EXPECT_EQ(store.CountJobs().queued, 2);
}
#endif

// Workers of several servers; the first attempts outlive their leases.
class KilledDatabase {
 public:
  KilledDatabase(PostgresqlCluster& cluster, int pairs, int kills)
      : cluster_(cluster), address_(cluster.NewDatabase()), kills_(kills) {
    PostgresqlJobStore store(address_, StoreRole::kServer, std::nullopt, Options());
    AddScene(store);
    for (int i = 0; i < pairs; ++i) store.CreateGraph(PairOfJobs(), {}, kNoLimit);
  }
  // Returns when all jobs have ended, or after a minute and a half.
  void Run() {
    std::vector<std::thread> threads;
    for (int i = 0; i < 3; ++i) threads.emplace_back([this, i] { Work("w" + std::to_string(i)); });
    threads.emplace_back([this] { Reap(); });
    for (int i = 0; i < kills_; ++i) {
      SleepFor(700);
      cluster_.Kill();
      cluster_.Start();
    }
    killing_ = false;
    for (std::thread& thread : threads) thread.join();
  }
  const std::string& address() const { return address_; }
  int outlived() const { return outlived_; }
  static constexpr int kLate = 2;  // fewer than workers

 private:
  static constexpr int64_t kLeaseMs = 800;

  static StoreOptions Options() {
    StoreOptions options;
    options.max_attempts = 1000;
    options.retry_backoff_ms = 1;
    return options;
  }
  // Repeats a call until the database answers it. Returns false if the lease was lost.
  template <typename Call>
  bool Insist(const Call& call) {
    while (!Ends()) {
      try {
        call();
        return true;
      } catch (const Error& e) {
        if (e.code() != ErrorCode::kUnavailable) return false;
      }
    }
    return false;
  }
  bool Ends() const { return done_ || std::chrono::steady_clock::now() > end_; }
  void Work(const std::string& name) {
    PostgresqlJobStore store(address_, StoreRole::kTool, std::nullopt, Options());
    while (!Ends()) {
      std::optional<JobRecord> job;
      if (!Insist([&] { job = store.Claim(name, kLeaseMs); }) || !job) {
        SleepFor(20);
        continue;
      }
      SleepFor(60);
      if (late_.fetch_add(1) < kLate) OutliveLease(store, *job);
      Insist([&] { store.Publish({job->id, job->lease_epoch}, ResultOfAttempt(*job)); });
    }
  }
  // Returns when another worker has the job.
  void OutliveLease(JobStore& store, const JobRecord& job) {
    bool is_lost = false;
    while (!is_lost && !Ends()) {
      SleepFor(20);
      Insist([&] { is_lost = store.GetJob(job.name).lease_epoch > job.lease_epoch; });
    }
    outlived_ += is_lost ? 1 : 0;
  }
  void Reap() {
    PostgresqlJobStore store(address_, StoreRole::kServer, std::nullopt, Options());
    while (!Ends()) {
      Insist([&] { store.ReapExpired(); });
      const bool finished =
          Insist([&] { unfinished_ = store.CountJobs().queued + store.CountJobs().running; }) &&
          unfinished_ == 0;
      if (finished && !killing_) done_ = true;
      SleepFor(50);
    }
  }

  PostgresqlCluster& cluster_;
  const std::string address_;
  const int kills_;
  const std::chrono::steady_clock::time_point end_ =
      std::chrono::steady_clock::now() + std::chrono::seconds(90);
  std::atomic<bool> killing_{true}, done_{false};
  std::atomic<int> late_{0}, outlived_{0};
  int64_t unfinished_ = 0;
};

TEST_F(PostgresqlFaultsTest, KilledDatabaseLosesNothing) {
  constexpr int kPairs = 20;
  PostgresqlCluster own;
  KilledDatabase service(own, kPairs, /*kills=*/4);
  service.Run();
  EXPECT_EQ(service.outlived(), KilledDatabase::kLate);
  const std::vector<std::string> problems = Problems(service.address(), 2 * kPairs);
#ifdef COLOR3D_FENCE_OFF
  EXPECT_FALSE(problems.empty()) << "late writes were not noticed";
#else
  EXPECT_EQ(problems, std::vector<std::string>());
#endif
}

}  // namespace
}  // namespace color3d
