#include "core/base/mutex.h"

#include <gtest/gtest.h>

#include <thread>

namespace color3d {
namespace {

using std::chrono::milliseconds;

TEST(MutexLockTest, HoldsMutexExceptBetweenUnlockAndLock) {
  Mutex mutex;
  const auto is_free = [&] {
    bool free = false;
    std::thread([&] {
      if (!mutex.TryLock()) return;
      free = true;
      mutex.Unlock();
    }).join();
    return free;
  };
  {
    MutexLock lock(mutex);
    EXPECT_FALSE(is_free());
    lock.Unlock();
    EXPECT_TRUE(is_free());
    lock.Lock();
    EXPECT_FALSE(is_free());
  }
  EXPECT_TRUE(is_free());
}

TEST(CondVarTest, WaitForReturnsFalseAfterItsTime) {
  Mutex mutex;
  CondVar changed;
  const MutexLock lock(mutex);
  EXPECT_FALSE(changed.WaitFor(mutex, milliseconds(1)));
}

TEST(CondVarTest, WaitReleasesMutexUntilNotified) {
  Mutex mutex;
  CondVar changed;
  bool is_set = false;
  std::thread other([&] {
    const MutexLock lock(mutex);
    is_set = true;
    changed.NotifyOne();
  });
  {
    const MutexLock lock(mutex);
    while (!is_set) changed.Wait(mutex);
  }
  EXPECT_TRUE(is_set);
  other.join();
}

}  // namespace
}  // namespace color3d
