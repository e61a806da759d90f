// Initial Gaussians of moving objects, for which structure from motion has no points. Internal to
// the splat module. Deterministic for every thread count.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/parallel.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/movers/motion_survey.h"

namespace color3d {

struct MoverSeedOptions {
  int rows = 0;  // of a parameter block, without motion
  int channels = 1;
  int coefficients = 1;   // of a colour channel
  int64_t most = 0;       // maximum number of seeds
  double width = 0.7;     // deviation of the first time window, relative to the interval
  double interval = 1.0;  // from one time step to the next, in units of GaussianMotion's t
};

// Creates one Gaussian per moving pixel (or per several, so that there are at most `most`), visible
// around its own time only. Its depth is the one at which the other cameras of that time also show
// motion and the same luminance (a visual hull); without other cameras, that of the static surface
// at the foot of its region (objects stand on the ground), and never behind that surface. Returns
// options.rows + kMotionRows rows; none if nothing moves. `unit_time` has t of each view.
ParameterBlock SeedMovers(const std::vector<SurveyedView>& views,
                          const std::vector<float>& unit_time,
                          const MoverSeedOptions& options,
                          ThreadPool& pool);

}  // namespace color3d
