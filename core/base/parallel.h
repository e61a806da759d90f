// A persistent pool of threads for data-parallel loops. One loop at a time per pool; the calling
// thread takes part. Same work split for the same thread count, so results can be reproducible.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace color3d {

class ThreadPool {
 public:
  // `threads` >= 1; 0 takes what the machine has.
  explicit ThreadPool(int threads = 0);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int thread_count() const { return static_cast<int>(workers_.size()) + 1; }

  // Calls body(index, thread) for every index in [0, count), handing out indices dynamically;
  // thread is in [0, thread_count()). Which thread gets an index is not deterministic. Rethrows
  // the first exception after all threads have stopped.
  void ForEach(int64_t count, const std::function<void(int64_t index, int thread)>& body);

  // Splits [0, count) into thread_count() contiguous ranges, one per thread, always the same way.
  void ForRanges(int64_t count,
                 const std::function<void(int64_t begin, int64_t end, int thread)>& body);

 private:
  void Run(const std::function<void(int thread)>& task);
  void WorkerLoop(int thread);

  std::vector<std::thread> workers_;
  std::mutex mutex_;
  std::condition_variable start_;
  std::condition_variable done_;
  const std::function<void(int)>* task_ = nullptr;
  std::atomic<uint64_t> generation_ = 0;  // changed under the mutex, watched without it
  std::atomic<int> running_ = 0;
  bool stopping_ = false;
  std::exception_ptr failure_;
};

}  // namespace color3d
