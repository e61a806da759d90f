#include "server/ops/idle_watch.h"

#include <algorithm>
#include <utility>

namespace color3d {
namespace {
constexpr std::chrono::milliseconds kLongestPause{5000};
}  // namespace

IdleWatch::IdleWatch(std::chrono::milliseconds limit,
                     std::function<bool()> is_busy,
                     std::function<void()> on_idle)
    : limit_(limit), is_busy_(std::move(is_busy)), on_idle_(std::move(on_idle)) {
  thread_ = std::thread([this] { Loop(); });
}

IdleWatch::~IdleWatch() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  wake_.NotifyAll();
  thread_.join();
}

void IdleWatch::NoteCall(const std::string& method) {
  if (method.starts_with("/grpc.") || method.starts_with("/color3d.internal.")) return;
  const MutexLock lock(mutex_);
  last_use_ = Steady::now();
}

void IdleWatch::Loop() {
  while (true) {
    {
      MutexLock lock(mutex_);
      const auto end = Steady::now() + std::min(limit_ / 4, kLongestPause);
      while (!stopping_ && wake_.WaitUntil(mutex_, end)) continue;
      if (stopping_) return;
    }
    const bool busy = is_busy_();
    const MutexLock lock(mutex_);
    if (busy) last_use_ = Steady::now();
    if (Steady::now() - last_use_ < limit_) continue;
    break;
  }
  on_idle_();
}

}  // namespace color3d
