// Hears of events that other processes commit, and holds the lock of the server that runs the
// chores of all. Has its own thread and connection. Thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <thread>

#include "core/base/mutex.h"

namespace color3d {

class PostgresqlListener {
 public:
  // Connects in the background, again after each loss. `wants_chores`: tries to get that lock.
  PostgresqlListener(std::string address, bool wants_chores);
  ~PostgresqlListener();
  PostgresqlListener(const PostgresqlListener&) = delete;
  PostgresqlListener& operator=(const PostgresqlListener&) = delete;

  // Returns a revision such that all events up to it are committed; -1 while there is no
  // connection. Later events are heard of at once.
  int64_t Newest();
  // Waits for an event after `revision` until `limit` is over. Returns true if there is one.
  bool WaitForEvent(int64_t revision, std::chrono::milliseconds limit);
  // Returns true if this process holds the lock. At most one process of all holds it, except for
  // some seconds after a loss of its connection that it has not noticed.
  bool HasChores();

 private:
  class Receiver;

  void Loop();
  // Until the connection is lost (throws) or the destructor runs.
  void Listen();
  void Hear(int64_t revision);

  const std::string address_;
  const bool wants_chores_;
  Mutex mutex_;
  CondVar changed_;
  bool stopping_ COLOR3D_GUARDED_BY(mutex_) = false;
  int64_t newest_ COLOR3D_GUARDED_BY(mutex_) = -1;
  bool has_chores_ COLOR3D_GUARDED_BY(mutex_) = false;
  int wake_ = -1;  // eventfd
  std::thread thread_;
};

}  // namespace color3d
