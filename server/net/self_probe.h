// Checks periodically whether the own server still answers. Runs one thread.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include "core/base/mutex.h"

namespace color3d {

struct SelfProbeTiming {
  std::chrono::milliseconds pause{10'000};  // between two probes
  std::chrono::milliseconds limit{10'000};  // time limit of a probe
  int failures = 3;                         // consecutive failures until on_deaf is called
};

class SelfProbe {
 public:
  // `probe` gets the time limit and returns an empty string or the reason of failure, like
  // ProbePort. `on_deaf` gets that reason, once. Both are called on the thread of this object.
  SelfProbe(const SelfProbeTiming& timing,
            std::function<std::string(std::chrono::milliseconds limit)> probe,
            std::function<void(const std::string& why)> on_deaf);
  // Waits for the probe under way.
  ~SelfProbe();
  SelfProbe(const SelfProbe&) = delete;
  SelfProbe& operator=(const SelfProbe&) = delete;

  // Returns whether the last probe succeeded. Thread-safe.
  bool IsAnswering() const { return failures_.load() == 0; }

 private:
  void Loop();

  const SelfProbeTiming timing_;
  const std::function<std::string(std::chrono::milliseconds)> probe_;
  const std::function<void(const std::string&)> on_deaf_;
  std::atomic<int> failures_{0};
  Mutex mutex_;
  CondVar wake_;
  bool stopping_ COLOR3D_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace color3d
