// Keeps the last good training state and restores it with half the learning rate if a value is not
// finite. Internal to the splat module.
#pragma once

#include "core/base/error.h"
#include "core/base/progress.h"
#include "core/splat/training/training_state.h"

namespace color3d {

// `State` is TrainingState or derived from it.
template <class State>
class TrainingGuard {
 public:
  // `what`: name of the training, for messages.
  TrainingGuard(const char* what, ProgressObserver& progress) : what_(what), progress_(progress) {}

  bool IsDue(int64_t iteration) const { return iteration % kInterval == 0; }
  void Keep(const State& state) { good_ = state; }

  // Reports curve point "restored_non_finite": the restored iteration. Throws Error{kInternal}
  // after kMaxRestores.
  void Restore(State& state) {
    const int64_t iteration = state.iteration;
    const int32_t restores = state.restores + 1;
    const double rate_scale = state.rate_scale * 0.5;
    if (restores > kMaxRestores) {
      throw Error(ErrorCode::kInternal,
                  "{}: values that are not finite came back {} times, last at iteration {}; check "
                  "the pictures and poses, or lower the learning rate",
                  what_,
                  static_cast<int>(kMaxRestores),
                  iteration);
    }
    state = good_;
    state.restores = restores;
    state.rate_scale = rate_scale;
    progress_.OnError(iteration, "restored_non_finite", static_cast<double>(state.iteration));
    progress_.OnWarning(
        fmt::format("{}: a value was not finite at iteration {}; went back to iteration {} with {} "
                    "times the learning rate",
                    what_,
                    iteration,
                    state.iteration,
                    rate_scale));
  }

 private:
  static constexpr int64_t kInterval = 100;  // iterations
  static constexpr int32_t kMaxRestores = 6;
  const char* what_;
  ProgressObserver& progress_;
  State good_;
};

}  // namespace color3d
