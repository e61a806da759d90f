#include "server/ops/idle_watch.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/support/service/processes.h"

namespace color3d {
namespace {
using std::chrono::milliseconds;

class IdleWatchTest : public ::testing::Test {
 protected:
  bool IsIdleWithin(milliseconds time) {
    return WaitUntil([&] { return idle_ > 0; }, time);
  }
  std::atomic<bool> busy_{false};
  std::atomic<int> idle_{0};
  IdleWatch watch_{milliseconds(200), [this] { return busy_.load(); }, [this] { ++idle_; }};
};

TEST_F(IdleWatchTest, EndsOnceWithoutCalls) {
  EXPECT_TRUE(IsIdleWithin(milliseconds(5000)));
  watch_.NoteCall("/color3d.v1.JobService/GetJob");
  std::this_thread::sleep_for(milliseconds(400));
  EXPECT_EQ(idle_, 1);
}

TEST_F(IdleWatchTest, CallsOfClientsKeepIt) {
  for (int i = 0; i < 20; ++i) {
    watch_.NoteCall("/color3d.v1.JobService/GetJob");
    std::this_thread::sleep_for(milliseconds(30));
  }
  EXPECT_EQ(idle_, 0);
  for (int i = 0; i < 20; ++i) {
    watch_.NoteCall("/color3d.internal.WorkerService/Claim");
    watch_.NoteCall("/grpc.health.v1.Health/Check");
    std::this_thread::sleep_for(milliseconds(30));
  }
  EXPECT_EQ(idle_, 1);
}

TEST_F(IdleWatchTest, WorkKeepsIt) {
  busy_ = true;
  std::this_thread::sleep_for(milliseconds(600));
  EXPECT_EQ(idle_, 0);
  busy_ = false;
  EXPECT_TRUE(IsIdleWithin(milliseconds(5000)));
}

}  // namespace
}  // namespace color3d
