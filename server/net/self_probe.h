// The server's own client: looks again and again whether the server still answers. One thread.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace color3d {

struct SelfProbeTiming {
  std::chrono::milliseconds pause{10'000};  // between two looks
  std::chrono::milliseconds limit{10'000};  // for one
  int failures = 3;                         // in a row: it is deaf
};

class SelfProbe {
 public:
  // `probe` is given the limit and says why nobody answered, or nothing, as ProbePort. `on_deaf` is
  // told that reason, once. Both are called on the thread of this object.
  SelfProbe(const SelfProbeTiming& timing,
            std::function<std::string(std::chrono::milliseconds limit)> probe,
            std::function<void(const std::string& why)> on_deaf);
  // Waits for the look that is under way.
  ~SelfProbe();
  SelfProbe(const SelfProbe&) = delete;
  SelfProbe& operator=(const SelfProbe&) = delete;

  // Whether the last look found an answer. Thread-safe.
  bool IsAnswering() const { return failures_.load() == 0; }

 private:
  void Loop();

  const SelfProbeTiming timing_;
  const std::function<std::string(std::chrono::milliseconds)> probe_;
  const std::function<void(const std::string&)> on_deaf_;
  std::atomic<int> failures_{0};
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace color3d
