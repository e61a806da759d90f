// A few threads for work that touches disk or the job store, so that gRPC's callback threads never
// block. Thread-safe.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace color3d {

class Executor {
 public:
  explicit Executor(int threads, size_t max_waiting = 2000);
  // Runs what is queued, then stops.
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // False when too much waits already: tell the client to come back later.
  bool TryPost(std::function<void()> task);
  // Always accepted: for the next step of a stream, of which each has at most one.
  void Post(std::function<void()> task);

 private:
  void Loop();

  const size_t max_waiting_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> tasks_;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace color3d
