#include "server/rpc/calls/executor.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <mutex>
#include <string>

namespace color3d {
namespace {

TEST(ExecutorTest, WhoeverHasMuchToDoLetsOthersTakeTurns) {
  std::promise<void> go, done;
  std::mutex mutex;
  std::string order;
  {
    Executor executor(1);
    executor.Post([&] { go.get_future().wait(); }, "first");
    const auto note = [&](char who) {
      return [&, who] {
        std::lock_guard lock(mutex);
        order += who;
      };
    };
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(executor.TryPost(note('a'), "a"));
    for (int i = 0; i < 2; ++i) EXPECT_TRUE(executor.TryPost(note('b'), "b"));
    go.set_value();
  }
  EXPECT_EQ(order, "ababaa");
}

TEST(ExecutorTest, OneOwnerHasNotAllThreads) {
  std::promise<void> release, other_ran;
  const auto released = release.get_future().share();
  std::atomic<int> running{0}, most{0};
  {
    Executor executor(3, 2000, 2);
    for (int i = 0; i < 6; ++i) {
      executor.Post(
          [&, released] {
            const int now = ++running;
            for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
            }
            released.wait();
            --running;
          },
          "a");
    }
    executor.Post([&] { other_ran.set_value(); }, "b");
    EXPECT_EQ(other_ran.get_future().wait_for(std::chrono::seconds(20)), std::future_status::ready)
        << "a thread was left for it";
    release.set_value();
  }
  EXPECT_LE(most, 2);
  EXPECT_EQ(running, 0) << "all of them ran before the end";
}

TEST(ExecutorTest, BeyondItsLineItTakesNoMore) {
  std::promise<void> go, begun;
  Executor executor(1, 2);
  executor.Post([&] {
    begun.set_value();
    go.get_future().wait();
  });
  begun.get_future().wait();
  EXPECT_TRUE(executor.TryPost([] {}, "a"));
  EXPECT_TRUE(executor.TryPost([] {}, "b"));
  EXPECT_FALSE(executor.TryPost([] {}, "c"));
  go.set_value();
}

}  // namespace
}  // namespace color3d
