#include "server/net/self_probe.h"

#include <spdlog/spdlog.h>

#include <utility>

namespace color3d {

SelfProbe::SelfProbe(const SelfProbeTiming& timing,
                     std::function<std::string(std::chrono::milliseconds)> probe,
                     std::function<void(const std::string&)> on_deaf)
    : timing_(timing), probe_(std::move(probe)), on_deaf_(std::move(on_deaf)) {
  thread_ = std::thread([this] { Loop(); });
}

SelfProbe::~SelfProbe() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  wake_.NotifyAll();
  thread_.join();
}

void SelfProbe::Loop() {
  while (true) {
    {
      MutexLock lock(mutex_);
      const auto end = std::chrono::steady_clock::now() + timing_.pause;
      while (!stopping_ && wake_.WaitUntil(mutex_, end)) continue;
      if (stopping_) return;
    }
    const std::string why = probe_(timing_.limit);
    if (why.empty()) {
      if (failures_.exchange(0) > 0) spdlog::info("the server answers itself again");
      continue;
    }
    spdlog::warn("the server does not answer itself: {}", why);
    if (++failures_ == timing_.failures) on_deaf_(why);
  }
}

}  // namespace color3d
