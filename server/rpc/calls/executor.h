// A few threads for work that touches disk or the job store, so that gRPC's callback threads never
// block. Whoever has much to do shares them with the others: tasks stand in a line of their
// owner's, and lines take turns. Thread-safe.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace color3d {

class Executor {
 public:
  // `max_of_owner`: threads that one owner's tasks have at once.
  explicit Executor(int threads, size_t max_waiting = 2000, int max_of_owner = INT32_MAX);
  // Runs what is queued, then stops.
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // False when too much waits already: tell the client to come back later.
  bool TryPost(std::function<void()> task, const std::string& owner = "");
  // Always accepted: for the next step of a stream, of which each has at most one.
  void Post(std::function<void()> task, const std::string& owner = "");

 private:
  struct Line {
    std::deque<std::function<void()>> waiting;
    int running = 0;
  };

  void Loop();
  // With the mutex held.
  void Add(std::function<void()> task, const std::string& owner);
  // The position in `turns_` of the next owner who may run a task; that of the end: none.
  size_t NextTurn() const;

  const size_t max_waiting_;
  const int max_of_owner_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::map<std::string, Line> lines_;  // by owner
  std::deque<std::string> turns_;      // owners whose tasks wait
  size_t waiting_ = 0;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace color3d
