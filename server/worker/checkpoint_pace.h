// Decides when the next checkpoint of a job is worth its cost, by the caller's clock. Not
// thread-safe.
#pragma once

#include <algorithm>
#include <chrono>
#include <optional>

namespace color3d {

class CheckpointPace {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // `interval`: minimum time between checkpoints; 0: saves at each opportunity.
  CheckpointPace(std::chrono::milliseconds interval, Time now)
      : interval_(interval), last_save_(now) {}

  // Returns true if it is time; saving then begins now.
  bool IsDue(Time now) {
    // Some states grow with progress and are saved as a whole.
    const std::chrono::nanoseconds pause =
        interval_.count() > 0
            ? std::max<std::chrono::nanoseconds>(interval_, kWorkPerSaving * last_took_)
            : std::chrono::nanoseconds(0);
    if (now - last_save_ < pause) return false;
    saving_since_ = now;
    return true;
  }
  void OnSaved(Time now) {
    last_took_ = saving_since_ ? now - *saving_since_ : std::chrono::nanoseconds(0);
    saving_since_.reset();
    last_save_ = now;
  }

 private:
  static constexpr int kWorkPerSaving = 20;  // saving takes at most a twentieth of the time

  const std::chrono::milliseconds interval_;
  Time last_save_;
  std::chrono::nanoseconds last_took_{0};
  std::optional<Time> saving_since_;
};

}  // namespace color3d
