// The first part of a joint training, as a value and as a file: the state of training at the end of
// the warm-up on luminance, with all that its second part needs (GAUSSIANS.md "Joint training").
// Plain values and pure functions.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/splat/geometry/geometry_options.h"
#include "core/splat/geometry/geometry_problem.h"
#include "core/splat/geometry/geometry_state.h"
#include "core/splat/model/color_layout.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

struct WarmUp {
  GeometryOptions options;  // of the whole training
  int max_side_px = 0;      // working size of the pictures
  int64_t picture_cache_bytes = 0;
  GeometryState state;
};

std::string SerializeWarmUp(const WarmUp& warm_up);
// Throws Error{kInvalidArgument} for damaged bytes or those of another version.
WarmUp ParseWarmUp(std::string_view bytes);

// State at the beginning of a training: at problem.start, or of the initial Gaussians. Throws
// Error{kInvalidArgument} if problem.start belongs to other views or degrees.
GeometryState FirstState(const GeometryProblem& problem,
                         const GeometryOptions& options,
                         const ColorLayout& layout);

// A state as if `geometry` were the result of a warm-up by these options: for Gaussians that came
// with the scene.
GeometryState StateOf(const GaussianModel& geometry, const GeometryOptions& options);

// Extends the state of a warm-up (L' of `sh_degree`) to L', a', b': a' and b' start with the values
// and the moments of L', cut to their degree.
GeometryState WithChromaFromLuminance(const GeometryState& warm_up,
                                      int sh_degree,
                                      const ColorLayout& layout);

}  // namespace color3d
