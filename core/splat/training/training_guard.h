// Keeps the last good training state, and goes back to it with half the learning rate when
// something is not finite. Internal to the splat module.
#pragma once

#include <string>

#include "core/base/error.h"
#include "core/base/progress.h"
#include "core/splat/training/training_state.h"

namespace color3d {

class TrainingGuard {
 public:
  explicit TrainingGuard(ProgressObserver& progress) : progress_(progress) {}

  bool IsDue(int64_t iteration) const { return iteration % kInterval == 0; }
  void Keep(const TrainingState& state) { good_ = state; }

  // Reports curve point "restored_non_finite": the iteration that training went back to. Throws
  // Error{kInternal} after kMaxRestores.
  void Restore(const std::string& what, TrainingState& state) {
    const int64_t iteration = state.iteration;
    const int32_t restores = state.restores + 1;
    const double rate_scale = state.rate_scale * 0.5;
    if (restores > kMaxRestores) {
      throw Error(ErrorCode::kInternal,
                  what + ": values that are not finite came back " + std::to_string(kMaxRestores) +
                      " times, last at iteration " + std::to_string(iteration) +
                      "; check the pictures and poses, or lower the learning rate");
    }
    state = good_;
    state.restores = restores;
    state.rate_scale = rate_scale;
    progress_.OnError(iteration, "restored_non_finite", static_cast<double>(state.iteration));
    progress_.OnWarning(what + ": a value was not finite at iteration " +
                        std::to_string(iteration) + "; went back to iteration " +
                        std::to_string(state.iteration) + " with " + std::to_string(rate_scale) +
                        " times the learning rate");
  }

 private:
  static constexpr int64_t kInterval = 100;
  static constexpr int32_t kMaxRestores = 6;
  ProgressObserver& progress_;
  TrainingState good_;
};

}  // namespace color3d
