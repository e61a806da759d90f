// A server is drained under load and another one starts on its folder: clients of the library
// notice only a pause.
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>

#include "client/lib/blob_transfer.h"
#include "client/lib/job_watch.h"
#include "core/base/files.h"
#include "tests/support/service/processes.h"
#include "tests/support/service/scripted_trace.h"
#include "tests/support/service/server_process.h"

namespace color3d {
namespace {
using client::Connection;
using client::WatchEnd;
using std::chrono::seconds;
using std::chrono::steady_clock;
using testing::ScriptedSpec;
using testing::ServerProcess;
using testing::TestClient;

constexpr int kWatchers = 50;
constexpr int kSteps = 60;
constexpr size_t kUploadBytes = 4 << 20;  // eight chunks

// Blocks an upload after its first chunk until it is released.
class Gate {
 public:
  void Arrive() {
    std::unique_lock lock(mutex_);
    has_arrived_ = true;
    changed_.notify_all();
    changed_.wait(lock, [this] { return is_open_; });
  }
  bool WaitForArrival() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, seconds(10), [this] { return has_arrived_; });
  }
  void Open() {
    std::lock_guard lock(mutex_);
    is_open_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool has_arrived_ = false, is_open_ = false;
};

class DrainTest : public ::testing::Test {
 protected:
  ~DrainTest() override {
    gate_.Open();
    for (std::thread& thread : threads_) thread.join();
  }
  std::unique_ptr<ServerProcess> Start() {
    return std::make_unique<ServerProcess>(scratch_.path(),
                                           std::vector<std::string>{"--listen", listen_});
  }
  void Watch(Connection& connection, const std::string& job) {
    threads_.emplace_back([this, &connection, job] {
      std::set<int> attempts;
      bool has_succeeded = false;
      const WatchEnd end = client::WatchJobs(
          connection,
          {job},
          [&](const v1::JobEvent& event) {
            if (event.job().name() != job) return;
            ++heard_;
            attempts.insert(event.job().attempt());
            has_succeeded |= event.job().state() == v1::Job::STATE_SUCCEEDED;
          },
          [this] { return !is_over_; });
      if (end == WatchEnd::kFinished && has_succeeded) ++finished_;
      if (!attempts.empty() && *attempts.rbegin() > 1) ++saw_another_attempt_;
    });
  }
  void Upload(Connection& connection) {
    WriteFileAtomic(file_, content_);
    threads_.emplace_back([this, &connection] {
      client::UploadMissing(
          connection, {{file_, DigestFile(file_)}}, [this](int64_t, int64_t) { gate_.Arrive(); });
      is_uploaded_ = true;
    });
  }

  ScratchFolder scratch_;
  const std::string listen_ = "unix:" + (scratch_.path() / "socket").string();
  const std::filesystem::path file_ = scratch_.path() / "file";
  const std::string content_ = std::string(kUploadBytes, 'u');
  CancellationToken never_;
  Gate gate_;
  std::atomic<int> heard_{0}, finished_{0}, saw_another_attempt_{0};
  std::atomic<bool> is_over_{false}, is_uploaded_{false};
  std::vector<std::thread> threads_;
};

TEST_F(DrainTest, WatchesUploadsAndJobsContinueWithNextServer) {
  auto server = Start();
  Connection watching({.address = listen_}, never_), uploading({.address = listen_}, never_);
  const std::string script = "ms=50,steps=" + std::to_string(kSteps);
  const std::string job =
      server->client().Create(ScriptedSpec(server->client().MakeScene().name(), script)).name();
  for (int i = 0; i < kWatchers; ++i) Watch(watching, job);
  Upload(uploading);
  ASSERT_TRUE(gate_.WaitForArrival());
  ASSERT_TRUE(
      WaitUntil([&] { return server->client().Get(job).progress().step() >= 5; }, seconds(20)));
  ASSERT_TRUE(WaitUntil([&] { return heard_ >= kWatchers; }, seconds(10)));

  const auto told = steady_clock::now();
  server->Signal(SIGTERM);
  EXPECT_EQ(server->Wait(), 0);
  EXPECT_LT(steady_clock::now() - told, seconds(20)) << "--drain-seconds";
  EXPECT_EQ(finished_, 0);
  EXPECT_FALSE(is_uploaded_);

  server = Start();
  gate_.Open();
  EXPECT_TRUE(WaitUntil([&] { return finished_ == kWatchers && is_uploaded_; }, seconds(60)))
      << finished_ << " watchers finished; uploaded: " << is_uploaded_;
  is_over_ = true;
  TestClient& client = server->client();
  EXPECT_EQ(client.Download(testing::DigestOf(content_)), content_);
  const v1::Job done = client.WaitFinished(job);
  EXPECT_EQ(done.state(), v1::Job::STATE_SUCCEEDED);
  EXPECT_EQ(done.attempt(), 1) << "a drain does not count";
  EXPECT_EQ(saw_another_attempt_, 0);
  const testing::Trace trace = testing::ParseTrace(client.Download(done.artifacts(0).digest()));
  EXPECT_EQ(trace.steps, testing::Range(kSteps));
  EXPECT_EQ(trace.processes.size(), 2u) << "it did not go on where it was";
}

}  // namespace
}  // namespace color3d
