// Inputs of one chroma fit, common to both solvers. Internal to the splat module. References
// outlive the fit.
#pragma once

#include <chrono>

#include "core/base/run_control.h"
#include "core/splat/chroma/chroma_fit.h"
#include "core/splat/chroma/chroma_parameters.h"

namespace color3d {

class ChromaClock {
 public:
  double Seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

struct ChromaFitting {
  const GaussianModel& geometry;
  const ChromaProblem& problem;
  const ChromaOptions& options;
  const RunControl& run;
  const ChromaClock& clock;  // started before the closed form

  void Snapshot(int64_t iteration, const ChromaParameters& parameters) const {
    if (!problem.snapshot) return;
    problem.snapshot(iteration, [&] { return parameters.ToModel(geometry); });
  }
  // Returns true if the seconds of this attempt and the earlier ones exceed the limit.
  bool IsOutOfTime(double seconds) const {
    return options.time_limit_seconds > 0.0 && seconds >= options.time_limit_seconds;
  }
};

}  // namespace color3d
