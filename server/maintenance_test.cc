// Chores with short periods and controlled clocks.
#include "server/maintenance.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <functional>
#include <limits>

#include "server/storage/collector.h"
#include "server/storage/file_blob_store.h"
#include "tests/support/service/job_store_fixture.h"
#include "tests/support/unprivileged.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using std::chrono::milliseconds;

class MaintenanceTest : public JobStoreTest {
 protected:
  MaintenanceTest() { PrepareDataFolder(paths_); }

  static MaintenanceTiming Quick() {
    MaintenanceTiming timing;
    timing.reap = timing.sweep = timing.sweep_again = milliseconds(5);
    return timing;
  }
  // Runs chores until `done` returns true.
  void RunUntil(const std::function<bool()>& done, const MaintenanceTiming& timing = Quick()) {
    Maintenance chores(
        *store_, blobs_, uploads_, paths_, [this] { return wall_.load(); }, timing);
    for (int i = 0; i < 1000 && !done(); ++i) std::this_thread::sleep_for(milliseconds(5));
    EXPECT_TRUE(done());
  }
  void RunBriefly() {
    Maintenance chores(
        *store_, blobs_, uploads_, paths_, [this] { return wall_.load(); }, Quick());
    std::this_thread::sleep_for(milliseconds(100));
  }

  DataPaths paths_{scratch_.path() / "data"};
  FileBlobStore blobs_{paths_.Blobs(), {0}};
  UploadStore uploads_{paths_.Uploads(), blobs_, 1000};
};

TEST_F(MaintenanceTest, RemovesUnreferencedBlobsByTheSteadyClock) {
  const FileDigest orphan = blobs_.PutBytes("orphan");
  const FileDigest named = blobs_.PutBytes("resultsingle");
  CreateSingle();
  Publication publication;
  publication.artifacts = {{"result", named, "text/plain"}};
  store_->Publish(LeaseOf(ClaimOne()), publication);
  RunBriefly();
  EXPECT_TRUE(fs::exists(blobs_.Fetch(orphan.sha256))) << "noted, not removed";
  wall_ += int64_t{100} * 24 * 3600 * 1000;
  RunBriefly();
  EXPECT_TRUE(fs::exists(blobs_.Fetch(orphan.sha256))) << "a clock that was set says nothing";
  wall_ -= int64_t{100} * 24 * 3600 * 1000;
  now_ += int64_t{25} * 3600 * 1000;
  RunUntil([&] { return ReasonThrown([&] { blobs_.Fetch(orphan.sha256); }) == "BLOB_MISSING"; });
  EXPECT_TRUE(fs::exists(blobs_.Fetch(named.sha256)));
}

// The first listing of blobs fails.
class BusyDiskBlobs : public FileBlobStore {
 public:
  explicit BusyDiskBlobs(const fs::path& folder) : FileBlobStore(folder, {0}) {}
  std::vector<std::string> ForEach(
      const std::function<bool(const StoredBlob&)>& visit) const override {
    if (++sweeps == 1) throw Error(ErrorCode::kUnavailable, "the disk does not answer");
    return FileBlobStore::ForEach(visit);
  }
  mutable std::atomic<int> sweeps{0};
};

TEST_F(MaintenanceTest, RetriesFailedSweepsSoon) {
  BusyDiskBlobs blobs(paths_.Blobs());
  MaintenanceTiming timing = Quick();
  timing.sweep = std::chrono::hours(1);
  const Maintenance chores(
      *store_, blobs, uploads_, paths_, [this] { return wall_.load(); }, timing);
  for (int i = 0; i < 1000 && blobs.sweeps < 2; ++i) std::this_thread::sleep_for(milliseconds(5));
  std::this_thread::sleep_for(milliseconds(50));
  EXPECT_EQ(blobs.sweeps, 2);
  EXPECT_EQ(chores.counts().sweeps_failed, 1);
}

TEST_F(MaintenanceTest, DryRunNotesNothing) {
  blobs_.PutBytes("orphan");
  const auto never = [] { return false; };
  const auto due = [&](auto look) {
    return look(*store_, ListBlobs(blobs_, never).blobs, milliseconds(10));
  };
  EXPECT_TRUE(due(DueBlobsSoFar).empty());
  now_ += 10;
  EXPECT_TRUE(due(DueBlobs).empty()) << "noted now, for the first time";
  now_ += 10;
  EXPECT_TRUE(due(DueBlobsSoFar).empty()) << "as of the last sweep";
  EXPECT_EQ(due(DueBlobs).size(), 1u);
  EXPECT_EQ(due(DueBlobsSoFar).size(), 1u);
  const auto at_once = [] { return true; };
  EXPECT_TRUE(RemoveDue(*store_, blobs_, due(DueBlobs), at_once).empty());
  EXPECT_EQ(RemoveDue(*store_, blobs_, due(DueBlobs), never).size(), 1u);
}

TEST_F(MaintenanceTest, TouchRestartsTheAge) {
  const FileDigest orphan = blobs_.PutBytes("orphan");
  for (int day = 0; day < 5; ++day) {
    RunBriefly();
    now_ += int64_t{23} * 3600 * 1000;
    EXPECT_TRUE(blobs_.Touch(orphan)) << day;
  }
}

TEST_F(MaintenanceTest, RebootAddsNoAge) {
  const FileDigest orphan = blobs_.PutBytes("orphan");
  RunBriefly();
  store_.reset();
  now_ += int64_t{1} << 40;
  boot_id_ = "boot 2";
  Open();
  RunBriefly();
  EXPECT_TRUE(fs::exists(blobs_.Fetch(orphan.sha256)));
}

TEST_F(MaintenanceTest, DeletesOldJobsWithScenesAndLogs) {
  const JobRecord old = (CreateSingle(), ClaimOne());
  Succeed(old);
  std::ofstream(paths_.JobLogs() / (old.name.substr(5) + ".log")) << "it began\n";
  MaintenanceTiming timing = Quick();
  timing.keep_jobs = std::chrono::hours(24 * 30);
  wall_ += int64_t{31} * 24 * 3600 * 1000;
  store_->Pin(old.name, true);
  const auto a_day = [&] {  // a day of sweeps by the steady clock
    Maintenance chores(
        *store_, blobs_, uploads_, paths_, [this] { return wall_.load(); }, timing);
    for (int i = 0; i < 25; ++i) {
      std::this_thread::sleep_for(milliseconds(20));
      now_ += 3600 * 1000;
    }
  };
  a_day();
  EXPECT_EQ(StateOf(old.name), JobState::kSucceeded) << "pinned";
  store_->Pin(old.name, false);
  RunBriefly();  // another sweep continues after the last one
  const auto gone = [&] { return ReasonThrown([&] { store_->GetJob(old.name); }); };
  EXPECT_EQ(gone(), "nothing");
  a_day();
  a_day();
  EXPECT_EQ(gone(), "JOB_NOT_FOUND");
  EXPECT_EQ(ReasonThrown([&] { store_->GetScene("scenes/test"); }), "SCENE_NOT_FOUND");
  RunUntil([&] { return fs::is_empty(paths_.JobLogs()); }, timing);
}

TEST_F(MaintenanceTest, DeletesUncommittedScenes) {
  SceneRecord scene;
  scene.name = "scenes/abandoned";
  store_->CreateScene(scene, {}, {});
  wall_ += int64_t{8} * 24 * 3600 * 1000;
  RunBriefly();
  EXPECT_EQ(store_->GetScene(scene.name).name, scene.name) << "noted, not deleted";
  now_ += int64_t{25} * 3600 * 1000;
  RunUntil(
      [&] { return ReasonThrown([&] { store_->GetScene(scene.name); }) == "SCENE_NOT_FOUND"; });
  EXPECT_EQ(store_->GetScene("scenes/test").name, "scenes/test")
      << "committed, though without a job";
}

class UnreadableMaintenanceTest : private testing::Unprivileged, public MaintenanceTest {};

TEST_F(UnreadableMaintenanceTest, ReportsUnreadableFolders) {
  const FileDigest hidden = blobs_.PutBytes("hidden"), orphan = blobs_.PutBytes("orphan");
  const fs::path folder = blobs_.Fetch(hidden.sha256).parent_path().parent_path();
  ASSERT_NE(folder, blobs_.Fetch(orphan.sha256).parent_path().parent_path());
  fs::permissions(folder, fs::perms::none);
  RunBriefly();
  now_ += int64_t{25} * 3600 * 1000;
  {
    const Maintenance chores(
        *store_, blobs_, uploads_, paths_, [this] { return wall_.load(); }, Quick());
    for (int i = 0; i < 1000 && chores.counts().blobs_removed < 1; ++i) {
      std::this_thread::sleep_for(milliseconds(5));
    }
    EXPECT_EQ(chores.counts().blobs_removed, 1) << "the others are collected";
    EXPECT_FALSE(blobs_.Look(orphan.sha256).has_value());
    for (int i = 0; i < 1000 && chores.counts().sweeps_failed < 1; ++i) {
      std::this_thread::sleep_for(milliseconds(5));
    }
    EXPECT_GE(chores.counts().sweeps_failed, 1);
  }
  fs::permissions(folder, fs::perms::owner_all);
  EXPECT_TRUE(blobs_.Look(hidden.sha256).has_value());
}

TEST_F(MaintenanceTest, CreatesBallastWhileThereIsRoom) {
  Ballast ballast(paths_.BallastFile(), 1 << 20);
  MaintenanceTiming timing = Quick();
  timing.ballast = &ballast;
  RunUntil([&] { return ballast.IsThere(); }, timing);
  ballast.Release();
  timing.reserve_bytes = int64_t{1} << 60;
  Maintenance chores(
      *store_, blobs_, uploads_, paths_, [this] { return wall_.load(); }, timing);
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_FALSE(ballast.IsThere()) << "there is no room beyond the reserve";
}

TEST_F(MaintenanceTest, StartsNoJobWhileSpaceIsLow) {
  CreateSingle();
  MaintenanceTiming timing = Quick();
  timing.low_space_bytes = int64_t{1} << 60;
  RunUntil([&] { return store_->Holds().contains(Hold::kStorage); }, timing);
  EXPECT_FALSE(store_->Claim("w", kLease).has_value());
  timing.low_space_bytes = 1;
  RunUntil([&] { return store_->Holds().empty(); }, timing);
  EXPECT_TRUE(store_->Claim("w", kLease).has_value());
}

TEST_F(MaintenanceTest, SetsDamagedBlobsAside) {
  std::vector<FileDigest> all;
  for (int i = 0; i < 20; ++i) all.push_back(blobs_.PutBytes("blob " + std::to_string(i)));
  const fs::path damaged = blobs_.Fetch(all[7].sha256);
  fs::permissions(damaged, fs::perms::owner_all);
  std::ofstream(damaged, std::ios::binary) << "blob X";
  Scrubber scrubber(blobs_);
  const auto go_on = [] { return false; };
  std::vector<std::string> found;
  int64_t bytes = 0;
  for (int round = 0; round < 10; ++round) {  // a few blobs per round
    const Scrubber::Result result = scrubber.Scrub(ListBlobs(blobs_, go_on).blobs, 14, go_on);
    EXPECT_LE(result.bytes, 14 + 7);
    bytes += result.bytes;
    found.insert(found.end(), result.damaged.begin(), result.damaged.end());
  }
  EXPECT_GE(bytes, 20 * 6) << "all of them";
  EXPECT_EQ(found, std::vector<std::string>{all[7].sha256});
  EXPECT_FALSE(blobs_.Touch(all[7]));
  EXPECT_EQ(scrubber.Scrub(ListBlobs(blobs_, go_on).blobs, 1000, [] { return true; }).bytes, 0);
}

class FullStore : public SqliteJobStore {
 public:
  using SqliteJobStore::SqliteJobStore;
  int ReapExpired() override { throw Full(); }
  std::vector<std::string> ExpireLeases(const std::string&) override { throw Full(); }

 private:
  static Error Full() { return ServiceError(ErrorReason::kStorageFull, "full"); }
};

TEST_F(MaintenanceTest, ServerRunsAndStartsOnFullDisk) {
  store_->UpdateWorker({"gone", std::numeric_limits<int32_t>::max(), "", 0, 0});
  StoreOptions options;
  options.boot_id = boot_id_;
  FullStore full(File(), StoreRole::kServer, TestClocks(), options);
  EXPECT_NO_THROW(ExpireDeadWorkers(full)) << "leases expire by themselves";
  std::atomic<int> lives{0};
  MaintenanceTiming timing = Quick();
  timing.on_life = [&] { ++lives; };
  Maintenance chores(
      full, blobs_, uploads_, paths_, [this] { return wall_.load(); }, timing);
  for (int i = 0; i < 1000 && lives < 3; ++i) std::this_thread::sleep_for(milliseconds(5));
  EXPECT_GE(lives, 3) << "systemd's watchdog would have ended a server that answers";
}

// A hanging sweep does not delay lost jobs.
TEST_F(MaintenanceTest, ReapsLeasesDuringSweep) {
  class HangingBlobs : public FileBlobStore {
   public:
    using FileBlobStore::FileBlobStore;
    std::vector<std::string> ForEach(const std::function<bool(const StoredBlob&)>&) const override {
      while (!released) std::this_thread::sleep_for(milliseconds(1));
      throw Error(ErrorCode::kInternal, "the disk is gone");
    }
    std::atomic<bool> released{false};
  };
  HangingBlobs hanging(paths_.Blobs(), BlobStoreOptions{0});
  const JobRecord job = (CreateSingle(), ClaimOne());
  {
    Maintenance chores(
        *store_, hanging, uploads_, paths_, [this] { return wall_.load(); }, Quick());
    now_ += kLease + 1;
    for (int i = 0; i < 1000 && StateOf(job.name) != JobState::kQueued; ++i) {
      std::this_thread::sleep_for(milliseconds(5));
    }
    EXPECT_EQ(StateOf(job.name), JobState::kQueued);
    hanging.released = true;
  }
}

// Workers of other machines, which no pid identifies, keep their leases over a restart and are
// listed while they report.
TEST_F(MaintenanceTest, ForgetsSilentWorkersOfOtherMachines) {
  const JobRecord job = CreateSingle();
  ClaimOne("far-1@gpu");
  store_->UpdateWorker({"far-1@gpu", 0, job.name, 5, 0});
  store_->UpdateWorker({"worker-1-1", std::numeric_limits<int32_t>::max(), "", 5, 0});
  ExpireDeadWorkers(*store_);
  EXPECT_EQ(store_->ReapExpired(), 0) << "it may still run";
  ASSERT_EQ(store_->ListWorkers().size(), 1u);
  EXPECT_EQ(store_->ListWorkers()[0].worker_id, "far-1@gpu");
  store_->UpdateWorker({"worker-1-2", 1, "", 5, 0});
  MaintenanceTiming timing = Quick();
  timing.forget_workers = std::chrono::hours(1);
  RunUntil([] { return true; }, timing);
  EXPECT_EQ(store_->ListWorkers().size(), 2u);
  timing.forget_workers = milliseconds(20);
  RunUntil([&] { return store_->ListWorkers().size() == 1; }, timing);
  EXPECT_EQ(store_->ListWorkers()[0].worker_id, "worker-1-2") << "the supervisor knows about it";
  EXPECT_EQ(StateOf(job.name), JobState::kRunning) << "its lease ends by itself";
}

}  // namespace
}  // namespace color3d
