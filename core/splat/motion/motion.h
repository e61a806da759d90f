// Moving Gaussians: their parameters at a time, and the adjoint (DYNAMIC.md "Motion"). All other
// kernels work on a model at one time. Internal to the splat module. Deterministic for every thread
// count.
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

// Returns kMotionRows rows for model.motion.size() Gaussians.
ParameterBlock MotionFromModel(const GaussianModel& model);
// The inverse, from rows [row, row + kMotionRows) of `moving`; begin and end stay as they are.
void SetMotion(const ParameterBlock& moving, int row, GaussianMotion& motion);

// Moving Gaussians at a time. Gaussian i of `moving` is Gaussian first + i of a block of all.
struct MotionAt {
  const ParameterBlock& moving;
  int row;  // of `moving`, the first of kMotionRows; parameters may precede it
  float t;  // GaussianMotion::UnitTime
  int64_t first;
};

// Takes the moving Gaussians of `at` to their time. Those whose own time is nearer than `hidden`
// are not seen.
void ApplyMotion(const MotionAt& motion, ThreadPool& pool, ParameterBlock& at, float hidden = 0.0f);

// The adjoint. `at` holds all Gaussians at the time; `d_at` is dL/d(at). Sets `d_moving`, which
// gets the shape of `moving`.
void ApplyMotionBackward(const MotionAt& motion,
                         const ParameterBlock& at,
                         const ParameterBlock& d_at,
                         ThreadPool& pool,
                         ParameterBlock& d_moving);

// Widens windows in time that are narrower than exp(least).
void LimitWindows(float least, int row, ParameterBlock& moving);

}  // namespace color3d
