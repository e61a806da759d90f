// The moving Gaussians during training of geometry. They are rendered together with the static ones
// but trained apart, so that the static part is independent of time. Internal to the splat module.
// Deterministic for every thread count.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "core/base/parallel.h"
#include "core/simd/plane_buffer.h"
#include "core/splat/geometry/densify.h"
#include "core/splat/geometry/geometry_options.h"
#include "core/splat/geometry/geometry_problem.h"
#include "core/splat/model/color_layout.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/movers/mover_seeds.h"
#include "core/splat/training/adam.h"

namespace color3d {

// Empty until motion is detected. Rows: those of the static part, then kMotionRows.
struct MovingPart {
  ParameterBlock parameters;
  AdamMoments moments;
};

// Times of a problem's views.
struct TimeSpan {
  double begin_s = 0.0;
  double end_s = 0.0;
  int steps = 1;  // number of different times

  // From one time step to the next, in units of GaussianMotion's t; 1 with one step.
  double Interval() const { return steps > 1 ? 2.0 / (steps - 1) : 1.0; }
  float UnitTime(double time_s) const;
};
TimeSpan TimeSpanOf(const GeometryProblem& problem);

// Motion is detected in blocks of time, so that memory does not grow with the scene's length:
// blocks of about equal numbers of times if there are more views than this, but not fewer times
// than static regions need.
inline constexpr size_t kViewsAtOnce = 128;
inline constexpr size_t kFewestTimesAtOnce = 24;
// Contains each view once, in the given order; views of one time are in one block.
std::vector<std::vector<PosedCamera>> BlocksOfTime(const std::vector<PosedCamera>& views);

// Returns the picture of a view at a level.
using LevelTarget =
    std::function<std::shared_ptr<const PlaneBuffer>(const PosedCamera& view, int level)>;

struct MoverSearchResult {
  double moving_share = 0.0;  // motion energy: share of the pixels
  MovingPart moving;          // empty if motion is negligible and the scene is static
};
// Decides if and where the scene moves; `still` renders the static part well enough at this time.
MoverSearchResult FindMovingPart(const GeometryProblem& problem,
                                 const TimeSpan& times,
                                 const ParameterBlock& still,
                                 const ColorSpec& color,
                                 const LevelTarget& target,
                                 const GeometryOptions& options,
                                 ThreadPool& pool);

// Both parts at the time `t`, the static one first. `hidden`: see ApplyMotion.
void ComposeAt(const ParameterBlock& still,
               const MovingPart& moving,
               float t,
               ThreadPool& pool,
               ParameterBlock& at,
               float hidden = 0.0f);
// The adjoint; `gradient` is dL/d(at) on entry and dL/d(still) on return.
void DecomposeGradient(const ParameterBlock& still,
                       const MovingPart& moving,
                       float t,
                       const ParameterBlock& at,
                       ThreadPool& pool,
                       ParameterBlock& gradient,
                       ParameterBlock& moving_gradient);

// DensifyByGradient on both parts; statistics are of both together, and the remaining capacity is
// shared in proportion to their counts.
void DensifyParts(const GradientDensifyOptions& options, DensifyTarget& still, MovingPart& moving);

// The trained model.
GaussianModel ModelOfParts(const ParameterBlock& still,
                           const MovingPart& moving,
                           const TimeSpan& times,
                           const ColorLayout& layout);

}  // namespace color3d
