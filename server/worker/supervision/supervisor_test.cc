// Workers without reports are killed unless the disk is full.
#include "server/worker/supervision/supervisor.h"

#include <atomic>
#include <fstream>

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

}  // namespace
}  // namespace color3d
