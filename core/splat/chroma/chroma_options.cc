#include "core/splat/chroma/chroma_options.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/base/range_check.h"

namespace color3d {

void ChromaOptions::Validate() const {
  const RangeCheck check("chroma option");
  check("iterations", iterations, 0, 100'000);
  check("chroma_sh_degree", chroma_sh_degree, 0, 3);
  check("ssim_weight", ssim_weight, 0.0, 1.0);
  check("time_limit_seconds", time_limit_seconds, 0.0, 86'400.0);
  check("sweeps", sweeps, 0, 1000);
  check("rounds", rounds, 0, 1000);
  check("steps_per_round", steps_per_round, 1, 1000);
  check("residual_tolerance", residual_tolerance, 0.0, 1.0);
  check("objective_tolerance", objective_tolerance, 0.0, 1.0);
  check("tikhonov", tikhonov, 1e-6, 1e6);
  check("tikhonov_rest", tikhonov_rest, 1.0, 1e6);
  check("memory_budget_bytes", static_cast<double>(memory_budget_bytes), 0.0, 1e15);
  check("target_budget_bytes", static_cast<double>(target_budget_bytes), 0.0, 1e15);
  adjustment.Validate();
  if (color_space == ColorSpace::kLab) return;
  if (solver != Solver::kJoint) {
    throw InvalidArgument(
        "solve_chroma.color_space is rgb, which the solver joint alone can train; choose "
        "solver=joint or color_space=lab");
  }
  if (adjustment != ChromaAdjustment{}) {
    throw InvalidArgument(
        "saturation {}, tint {} and warmth {} change a and b, and a model in RGB has none; choose "
        "color_space=lab or leave them out",
        adjustment.saturation,
        adjustment.tint,
        adjustment.warmth);
  }
}

ChromaOptions ForManyFrames(ChromaOptions options) {
  constexpr int64_t kMemoryBytes = int64_t{384} << 20;
  constexpr int64_t kTargetBytes = int64_t{96} << 20;
  options.memory_budget_bytes = std::min(options.memory_budget_bytes, kMemoryBytes);
  options.target_budget_bytes = std::min(options.target_budget_bytes, kTargetBytes);
  return options;
}

}  // namespace color3d
