// What moves while geometry is trained, beside what stands still: the two are drawn together and
// trained apart, so that what stands still never meets time. Internal to the splat module.
// Deterministic whatever the thread count.
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
#include "core/splat/geometry/mover_seeds.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/training/adam.h"

namespace color3d {

// Empty until something moves. Rows: those of what stands still, then kMotionRows.
struct MovingPart {
  ParameterBlock parameters;
  AdamMoments moments;
};

// The times of a problem's views.
struct TimeSpan {
  double begin_s = 0.0;
  double end_s = 0.0;
  int steps = 1;  // different times

  // From one time step to the next, in units of GaussianMotion's t; 1 with one step.
  double Interval() const { return steps > 1 ? 2.0 / (steps - 1) : 1.0; }
  float UnitTime(double time_s) const;
};
TimeSpan TimeSpanOf(const GeometryProblem& problem);

// Motion is looked for in blocks of time, so that memory does not grow with the scene's length:
// some blocks of about as many times each where there are more views than these, but not fewer
// times than tell what stands still.
inline constexpr size_t kViewsAtOnce = 128;
inline constexpr size_t kFewestTimesAtOnce = 24;
// Each view once, in the given order; those of one time are in one block.
std::vector<std::vector<PosedCamera>> BlocksOfTime(const std::vector<PosedCamera>& views);

// The picture of a view at a level.
using LevelTarget =
    std::function<std::shared_ptr<const PlaneBuffer>(const PosedCamera& view, int level)>;

struct FoundMovers {
  double moving_share = 0.0;  // motion energy: share of the pixels
  MovingPart moving;          // empty where so little moves that the scene stands still
};
// Decides whether the scene moves, and where: `still` draws what stands still well enough by now.
FoundMovers FindMovingPart(const GeometryProblem& problem,
                           const TimeSpan& times,
                           const ParameterBlock& still,
                           const ColorSpec& color,
                           const LevelTarget& target,
                           const GeometryOptions& options,
                           ThreadPool& pool);

// Both at the moment `t`: those that stand still first. `hidden`: ApplyMotion.
void ComposeAt(const ParameterBlock& still,
               const MovingPart& moving,
               float t,
               ThreadPool& pool,
               ParameterBlock& at,
               float hidden = 0.0f);
// The adjoint; `gradient` comes as dL/d(at) and leaves as dL/d(still).
void DecomposeGradient(const ParameterBlock& still,
                       const MovingPart& moving,
                       float t,
                       const ParameterBlock& at,
                       ThreadPool& pool,
                       ParameterBlock& gradient,
                       ParameterBlock& moving_gradient);

// DensifyByGradient on both; statistics are of both together, and what room there is is shared by
// their numbers.
void DensifyParts(const GradientDensifyOptions& options, DensifyTarget& still, MovingPart& moving);

// The trained model; on colours its channels all have the same degree.
GaussianModel ModelOfParts(const ParameterBlock& still,
                           const MovingPart& moving,
                           const TimeSpan& times,
                           int channels,
                           int sh_degree);

}  // namespace color3d
