// std::mutex, a scoped lock and std::condition_variable with annotations for Clang's thread-safety
// analysis (core/base/thread_annotations.h). All are thread-safe but MutexLock.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

#include "core/base/thread_annotations.h"

namespace color3d {

class COLOR3D_CAPABILITY("mutex") Mutex {
 public:
  Mutex() = default;
  Mutex(const Mutex&) = delete;
  Mutex& operator=(const Mutex&) = delete;

  void Lock() COLOR3D_ACQUIRE() { mutex_.lock(); }
  bool TryLock() COLOR3D_TRY_ACQUIRE(true) { return mutex_.try_lock(); }
  void Unlock() COLOR3D_RELEASE() { mutex_.unlock(); }

 private:
  friend class CondVar;
  std::mutex mutex_;
};

// Holds a mutex during its lifetime, except between Unlock() and Lock(). Not thread-safe.
class COLOR3D_SCOPED_CAPABILITY MutexLock {
 public:
  explicit MutexLock(Mutex& mutex) COLOR3D_ACQUIRE(mutex) : mutex_(mutex) { mutex_.Lock(); }
  ~MutexLock() COLOR3D_RELEASE() {
    if (held_) mutex_.Unlock();
  }
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

  void Unlock() COLOR3D_RELEASE() {
    mutex_.Unlock();
    held_ = false;
  }
  void Lock() COLOR3D_ACQUIRE() {
    mutex_.Lock();
    held_ = true;
  }

 private:
  Mutex& mutex_;
  bool held_ = true;
};

// Waiting releases the mutex. There are no predicates, because the analysis does not know that a
// lambda is called with the mutex held. Wait in a loop.
class CondVar {
 public:
  void Wait(Mutex& mutex) COLOR3D_REQUIRES(mutex) {
    std::unique_lock lock(mutex.mutex_, std::adopt_lock);
    condition_.wait(lock);
    lock.release();
  }
  // Returns false once the time has passed.
  template <typename Clock, typename Duration>
  bool WaitUntil(Mutex& mutex, const std::chrono::time_point<Clock, Duration>& time)
      COLOR3D_REQUIRES(mutex) {
    std::unique_lock lock(mutex.mutex_, std::adopt_lock);
    const std::cv_status status = condition_.wait_until(lock, time);
    lock.release();
    return status == std::cv_status::no_timeout;
  }
  template <typename Rep, typename Period>
  bool WaitFor(Mutex& mutex, const std::chrono::duration<Rep, Period>& time)
      COLOR3D_REQUIRES(mutex) {
    return WaitUntil(mutex, std::chrono::steady_clock::now() + time);
  }
  void NotifyOne() { condition_.notify_one(); }
  void NotifyAll() { condition_.notify_all(); }

 private:
  std::condition_variable condition_;
};

}  // namespace color3d
