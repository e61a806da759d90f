// Ends a server that nobody uses. Thread-safe.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include "core/base/mutex.h"

namespace color3d {

class IdleWatch {
 public:
  // Calls `on_idle` once, after `limit` without calls during which `is_busy` returned false. A
  // thread of this object calls both.
  IdleWatch(std::chrono::milliseconds limit,
            std::function<bool()> is_busy,
            std::function<void()> on_idle);
  ~IdleWatch();
  IdleWatch(const IdleWatch&) = delete;
  IdleWatch& operator=(const IdleWatch&) = delete;

  // Notes a call of a client; `method`: its full name, with a leading slash. Calls of workers and
  // health checks do not count.
  void NoteCall(const std::string& method);

 private:
  using Steady = std::chrono::steady_clock;

  void Loop();

  const std::chrono::milliseconds limit_;
  const std::function<bool()> is_busy_;
  const std::function<void()> on_idle_;
  Mutex mutex_;
  CondVar wake_;
  bool stopping_ COLOR3D_GUARDED_BY(mutex_) = false;
  Steady::time_point last_use_ COLOR3D_GUARDED_BY(mutex_) = Steady::now();
  std::thread thread_;  // last, because it uses the others
};

}  // namespace color3d
