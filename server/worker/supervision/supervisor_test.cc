// Workers without reports are killed unless the disk is full; other children are left alone.
#include "server/worker/supervision/supervisor.h"

#include <atomic>
#include <fstream>

#include "core/base/process/subprocess.h"
#include "tests/support/service/job_store_fixture.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

class FullStore : public SqliteJobStore {
 public:
  using SqliteJobStore::SqliteJobStore;
  bool IsFull() override {
    ++asked;
    return full;
  }
  std::atomic<int> asked{0};
  std::atomic<bool> full{true};
};

TEST_F(JobStoreTest, KillsSilentWorkerUnlessDiskIsFull) {
  const fs::path program = scratch_.path() / "worker", starts = scratch_.path() / "starts";
  WriteFileAtomic(program, "#!/bin/sh\necho begun >> " + starts.string() + "\nexec sleep 60\n");
  fs::permissions(program, fs::perms::owner_all);
  const auto count = [&] {
    std::ifstream file(starts);
    int lines = 0;
    for (std::string line; std::getline(file, line);) ++lines;
    return lines;
  };
  const auto becomes = [](const auto& done) {
    for (int i = 0; i < 3000 && !done(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return done();
  };
  FullStore store(File(), StoreRole::kTool, TestClocks());
  SupervisorOptions options;
  options.program = program;
  options.first_backoff = options.max_backoff = std::chrono::milliseconds(10);
  options.max_silent = std::chrono::milliseconds(200);
  Supervisor supervisor(options, store);
  EXPECT_TRUE(becomes([&] { return store.asked >= 3; }));
  EXPECT_EQ(count(), 1) << "it could not have reported itself";
  store.full = false;
  EXPECT_TRUE(becomes([&] { return count() >= 2; }));
}

// It takes the exit status of orphans, which a container's first process inherits.
TEST_F(JobStoreTest, LeavesExitStatusOfSubprocessesToTheirThreads) {
  SqliteJobStore store(File(), StoreRole::kTool, TestClocks());
  SupervisorOptions options;
  options.workers = 0;
  Supervisor supervisor(options, store);
  SubprocessOptions run;
  run.arguments = {"sh", "-c", "sleep 0.0$(($$ % 10)); exit 7"};
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(3);
  int runs = 0;
  for (; std::chrono::steady_clock::now() < end; ++runs) {
    ASSERT_EQ(RunSubprocess(run, CancellationToken()).exit_code, 7) << "run " << runs;
  }
  EXPECT_GT(runs, 10);
}

}  // namespace
}  // namespace color3d
