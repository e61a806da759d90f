#include "core/base/parallel.h"

#include <algorithm>
#include <chrono>

namespace color3d {
namespace {

// Time that a thread spins before it sleeps, since loops follow each other within microseconds and
// waking a thread takes up to 100 us. Other threads get the core meanwhile.
constexpr std::chrono::microseconds kWatchFor(50);

template <class Condition>
void WatchFor(const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + kWatchFor;
  while (!condition() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
}

}  // namespace

ThreadPool::ThreadPool(int threads) {
  if (threads <= 0) threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  for (int i = 1; i < threads; ++i) workers_.emplace_back([this, i] { WorkerLoop(i); });
}

ThreadPool::~ThreadPool() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  start_.NotifyAll();
  for (std::thread& worker : workers_) worker.join();
}

void ThreadPool::WorkerLoop(int thread) {
  uint64_t seen = 0;
  while (true) {
    const std::function<void(int)>* task = nullptr;
    WatchFor([&] { return generation_ != seen; });
    {
      const MutexLock lock(mutex_);
      while (!stopping_ && generation_ == seen) start_.Wait(mutex_);
      if (stopping_) return;
      seen = generation_;
      task = task_;
    }
    std::exception_ptr failure;
    try {
      (*task)(thread);
    } catch (...) {
      failure = std::current_exception();
    }
    const MutexLock lock(mutex_);
    if (failure && !failure_) failure_ = failure;
    if (--running_ == 0) done_.NotifyOne();
  }
}

void ThreadPool::Run(const std::function<void(int)>& task) {
  {
    const MutexLock lock(mutex_);
    task_ = &task;
    failure_ = nullptr;
    running_ = static_cast<int>(workers_.size());
    ++generation_;
  }
  start_.NotifyAll();
  std::exception_ptr failure;
  try {
    task(0);
  } catch (...) {
    failure = std::current_exception();
  }
  WatchFor([&] { return running_ == 0; });
  const MutexLock lock(mutex_);
  while (running_ != 0) done_.Wait(mutex_);
  task_ = nullptr;
  if (!failure) failure = failure_;
  if (failure) std::rethrow_exception(failure);
}

void ThreadPool::ForEach(int64_t count,
                         const std::function<void(int64_t index, int thread)>& body) {
  if (count <= 0) return;
  if (count == 1) return body(0, 0);  // waking the others would take longer than many a body
  std::atomic<int64_t> next{0};
  std::atomic<bool> failed{false};
  Run([&](int thread) {
    try {
      for (int64_t i; !failed && (i = next.fetch_add(1)) < count;) body(i, thread);
    } catch (...) {
      failed = true;
      throw;
    }
  });
}

void ThreadPool::ForRanges(
    int64_t count, const std::function<void(int64_t begin, int64_t end, int thread)>& body) {
  if (count <= 0) return;
  const int64_t threads = thread_count();
  Run([&](int thread) {
    const int64_t begin = count * thread / threads;
    const int64_t end = count * (thread + 1) / threads;
    if (begin < end) body(begin, end, thread);
  });
}

}  // namespace color3d
