// Thread pool for work that touches disk or the job store, so that gRPC's callback threads never
// block. Fair: each owner has its own queue, and the queues take turns. Thread-safe.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "core/base/mutex.h"

namespace color3d {

class Executor {
 public:
  // `max_of_owner`: maximum number of threads that run tasks of one owner at once.
  explicit Executor(int threads, size_t max_waiting = 2000, int max_of_owner = INT32_MAX);
  // Runs all queued tasks, then stops.
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // Returns false if the queue is full; the client should retry later.
  bool TryPost(std::function<void()> task, const std::string& owner = "");
  // Always accepts: for the next step of a stream; each stream has at most one.
  void Post(std::function<void()> task, const std::string& owner = "");

 private:
  struct Line {
    std::deque<std::function<void()>> waiting;
    int running = 0;
  };

  void Loop();
  void Add(std::function<void()> task, const std::string& owner) COLOR3D_REQUIRES(mutex_);
  // Returns the index in `turns_` of the next owner that may run a task, or its size if there is
  // none.
  size_t NextTurn() const COLOR3D_REQUIRES(mutex_);

  const size_t max_waiting_;
  const int max_of_owner_;
  Mutex mutex_;
  CondVar wake_;
  std::map<std::string, Line> lines_ COLOR3D_GUARDED_BY(mutex_);  // by owner
  std::deque<std::string> turns_ COLOR3D_GUARDED_BY(mutex_);      // owners with waiting tasks
  size_t waiting_ COLOR3D_GUARDED_BY(mutex_) = 0;
  bool stopping_ COLOR3D_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace color3d
