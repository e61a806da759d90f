// Gaussians in time: where they are at a moment, and the adjoint of that (DYNAMIC.md
// "Motion"). A model at one moment is a model as any other, so no kernel but these knows of time.
// Internal to the splat module. Deterministic whatever the thread count.
#pragma once

#include <cstdint>

#include "core/base/parallel.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {

// Rows of motion, counted from the first of them: in a block of moving Gaussians they follow the
// colour.
inline constexpr int kVelocityRow = 0;      // 3 rows
inline constexpr int kAccelerationRow = 3;  // 3 rows
inline constexpr int kSpinRow = 6;          // 4 rows
inline constexpr int kCenterRow = 10;
inline constexpr int kLogWidthRow = 11;
inline constexpr int kMotionRows = 12;

// Opacity below which a Gaussian is not drawn anyway, and its logit.
inline constexpr float kUnseenOpacity = 1e-4f;
inline constexpr float kUnseenLogit = -9.2102404f;

// The motion alone, kMotionRows rows for model.motion.size() Gaussians.
ParameterBlock MotionFromModel(const GaussianModel& model);
// The inverse, from rows [row, row + kMotionRows) of `moving`; begin and end stay as they are.
void SetMotion(const ParameterBlock& moving, int row, GaussianMotion& motion);

// Takes Gaussians [first, first + moving.count()) of `at` to the moment `t` (GaussianMotion), as
// rows [row, row + kMotionRows) of `moving` say. Those that belong to a time nearer than `hidden`
// are not seen.
void ApplyMotion(const ParameterBlock& moving,
                 int row,
                 float t,
                 int64_t first,
                 ThreadPool& pool,
                 ParameterBlock& at,
                 float hidden = 0.0f);

// The adjoint. `moving` holds parameters in rows [0, row) and motion from `row` on; `at` holds all
// Gaussians at `t`, with those of `moving` from `first` on; `d_at` is dL/d(at). Sets `d_moving`,
// which gets the shape of `moving`.
void ApplyMotionBackward(const ParameterBlock& moving,
                         int row,
                         float t,
                         int64_t first,
                         const ParameterBlock& at,
                         const ParameterBlock& d_at,
                         ThreadPool& pool,
                         ParameterBlock& d_moving);

// No window in time becomes narrower than exp(least).
void LimitWindows(float least, int row, ParameterBlock& moving);

// The model's parameters at a time of the scene, seconds; those that stand still are the same at
// any.
ParameterBlock ParametersAt(const GaussianModel& model, double time_s, ThreadPool& pool);
// The same as a model without motion: the Gaussians that are seen then.
GaussianModel ModelAt(const GaussianModel& model, double time_s, ThreadPool& pool);

}  // namespace color3d
