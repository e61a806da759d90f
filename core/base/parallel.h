// A persistent pool of threads for data-parallel loops. One loop at a time per pool; the calling
// thread takes part.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <thread>
#include <vector>

#include "core/base/mutex.h"

namespace color3d {

class ThreadPool {
 public:
  // 0 threads: as many as the machine has.
  explicit ThreadPool(int threads = 0);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int thread_count() const { return static_cast<int>(workers_.size()) + 1; }

  // Calls body(index, thread) for every index in [0, count), with thread in [0, thread_count()).
  // The assignment of indices to threads is not deterministic. Rethrows the first exception after
  // all threads have stopped.
  void ForEach(int64_t count, const std::function<void(int64_t index, int thread)>& body);

  // Splits [0, count) into thread_count() contiguous ranges, one per thread. Deterministic.
  void ForRanges(int64_t count,
                 const std::function<void(int64_t begin, int64_t end, int thread)>& body);

 private:
  void Run(const std::function<void(int thread)>& task);
  void WorkerLoop(int thread);

  std::vector<std::thread> workers_;
  Mutex mutex_;
  CondVar start_;
  CondVar done_;
  // These two change under the mutex and are watched without it.
  std::atomic<uint64_t> generation_ = 0;
  std::atomic<int> running_ = 0;
  const std::function<void(int)>* task_ COLOR3D_GUARDED_BY(mutex_) = nullptr;
  bool stopping_ COLOR3D_GUARDED_BY(mutex_) = false;
  std::exception_ptr failure_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d
