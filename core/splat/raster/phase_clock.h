// Time measurement of training by phase. One phase runs at a time, so the phases add up to the
// total; entering one costs a clock reading. Internal to the splat module. Not thread-safe: for the
// training thread.
#pragma once

#include <array>
#include <chrono>

namespace color3d {

enum class Phase {
  kOther,
  kProjection,
  kBinning,
  kForward,
  kLoss,
  kBackward,
  kProjectionBackward,
  kAdam,
  kDensify,
  kEvaluation,  // of held-out views: not part of training
};
inline constexpr int kPhaseCount = 10;
inline constexpr const char* kPhaseNames[kPhaseCount] = {"other",
                                                         "projection",
                                                         "binning",
                                                         "forward",
                                                         "loss",
                                                         "backward",
                                                         "projection_backward",
                                                         "adam",
                                                         "densify",
                                                         "evaluation"};
using PhaseSeconds = std::array<double, kPhaseCount>;

class PhaseClock {
 public:
  // Ends the running phase and begins `phase`.
  void Enter(Phase phase) {
    const auto now = std::chrono::steady_clock::now();
    seconds_[static_cast<int>(running_)] += std::chrono::duration<double>(now - since_).count();
    running_ = phase;
    since_ = now;
  }
  const PhaseSeconds& seconds() const { return seconds_; }  // up to the last Enter
  // All but evaluation, up to now.
  double TrainingSeconds() {
    Enter(running_);
    double sum = -seconds_[static_cast<int>(Phase::kEvaluation)];
    for (const double s : seconds_) sum += s;
    return sum;
  }

 private:
  PhaseSeconds seconds_{};
  Phase running_ = Phase::kOther;
  std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();
};

}  // namespace color3d
