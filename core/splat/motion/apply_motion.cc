// Motion and its adjoint (motion.h), sixteen Gaussians at a time.
#include <algorithm>
#include <cmath>

#include "core/simd/instruction_set.h"
#include "core/splat/motion/motion.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/splat/motion/apply_motion.cc"
#include <hwy/foreach_target.h>

#include "core/simd/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

using simd::Broadcast;
using simd::F32;

constexpr float kLog2E = 1.44269504f;
constexpr float kLn2 = 0.69314718f;
constexpr float kMaxOpacity = 1.0f - 1e-6f;
// Minimum width of a time window, so that no product overflows.
constexpr float kLeastLogWidth = -40.0f;
constexpr float kFarthest = 1e4f;  // limit of tau / width, far beyond visibility

HWY_INLINE F32 Exp(F32 x) {
  return simd::Exp2(simd::Clamp(x * kLog2E, Broadcast(-125.0f), Broadcast(125.0f)));
}
HWY_INLINE F32 Sigmoid(F32 x) { return 1.0f / (1.0f + Exp(-x)); }

struct Window {
  F32 tau;
  F32 inverse_width;
  F32 scaled;  // tau / width
};

HWY_INLINE Window WindowAt(const MotionAt& m, int64_t i) {
  Window w;
  w.tau = m.t - simd::Load(m.moving.Row(m.row + kCenterRow) + i);
  const F32 log_width = simd::Load(m.moving.Row(m.row + kLogWidthRow) + i);
  w.inverse_width = Exp(-simd::Max(log_width, Broadcast(kLeastLogWidth)));
  w.scaled = simd::Clamp(w.tau * w.inverse_width, Broadcast(-kFarthest), Broadcast(kFarthest));
  return w;
}

// Loads the first `lanes` of sixteen floats, the rest as zero; stores leave the rest unchanged. A
// row may end there.
HWY_INLINE F32 LoadSome(const float* p, int64_t lanes) {
  if (lanes >= simd::kLanes) return simd::Load(p);
  alignas(64) float some[simd::kLanes] = {};
  std::copy_n(p, lanes, some);
  return simd::Load(some);
}
HWY_INLINE void StoreSome(float* p, F32 v, int64_t lanes) {
  if (lanes >= simd::kLanes) return simd::Store(p, v);
  alignas(64) float some[simd::kLanes];
  simd::Store(some, v);
  std::copy_n(some, lanes, p);
}

// Blocks [begin, end) of sixteen moving Gaussians.
void MoveRange(const MotionAt& m, float hidden, int64_t begin, int64_t end, ParameterBlock& at) {
  const F32 unseen = Broadcast(kUnseenLogit);
  for (int64_t i = begin * simd::kLanes; i < end * simd::kLanes; i += simd::kLanes) {
    const int64_t lanes = m.moving.count() - i;
    const auto motion = [&](int k) HWY_ATTR { return simd::Load(m.moving.Row(m.row + k) + i); };
    const auto add = [&](int row, F32 change) HWY_ATTR {
      float* p = at.Row(row) + m.first + i;
      StoreSome(p, LoadSome(p, lanes) + change, lanes);
    };
    const Window w = WindowAt(m, i);
    for (int k = 0; k < 3; ++k) {
      add(kPositionRow + k,
          w.tau * (motion(kVelocityRow + k) + w.tau * motion(kAccelerationRow + k)));
    }
    for (int k = 0; k < 4; ++k) add(kRotationRow + k, w.tau * motion(kSpinRow + k));

    float* logit = at.Row(kOpacityRow) + m.first + i;
    const F32 opacity = simd::Min(
        Sigmoid(LoadSome(logit, lanes)) * Exp(-0.5f * w.scaled * w.scaled), Broadcast(kMaxOpacity));
    const F32 seen = kLn2 * simd::Log2(opacity / (1.0f - opacity));
    F32 moved = simd::Select(simd::Less(Broadcast(kUnseenOpacity), opacity), seen, unseen);
    moved = simd::Select(simd::Less(simd::Abs(w.tau), Broadcast(hidden)), unseen, moved);
    StoreSome(logit, moved, lanes);
  }
}

void BackwardRange(const MotionAt& m,
                   const ParameterBlock& at,
                   const ParameterBlock& d_at,
                   int64_t begin,
                   int64_t end,
                   ParameterBlock& d_moving) {
  for (int64_t i = begin * simd::kLanes; i < end * simd::kLanes; i += simd::kLanes) {
    const int64_t lanes = m.moving.count() - i;
    const auto motion = [&](int k) HWY_ATTR { return simd::Load(m.moving.Row(m.row + k) + i); };
    const auto gradient = [&](int row)
                              HWY_ATTR { return LoadSome(d_at.Row(row) + m.first + i, lanes); };
    const auto store = [&](int row, F32 v) HWY_ATTR { simd::Store(d_moving.Row(row) + i, v); };
    const Window w = WindowAt(m, i);
    F32 d_tau = simd::Zero();
    for (int k = 0; k < 3; ++k) {
      const F32 d = gradient(kPositionRow + k);
      store(m.row + kVelocityRow + k, w.tau * d);
      store(m.row + kAccelerationRow + k, w.tau * w.tau * d);
      d_tau = d_tau + d * (motion(kVelocityRow + k) + 2.0f * w.tau * motion(kAccelerationRow + k));
    }
    for (int k = 0; k < 4; ++k) {
      const F32 d = gradient(kRotationRow + k);
      store(m.row + kSpinRow + k, w.tau * d);
      d_tau = d_tau + d * motion(kSpinRow + k);
    }
    // dL/d logit at t is dL/d opacity times opacity (1 - opacity); Gaussians that are not drawn
    // have none.
    const F32 rest = Sigmoid(-LoadSome(at.Row(kOpacityRow) + m.first + i, lanes));
    const F32 d_log_opacity = gradient(kOpacityRow) / rest;
    store(kOpacityRow, d_log_opacity * Sigmoid(-simd::Load(m.moving.Row(kOpacityRow) + i)));
    store(m.row + kCenterRow, d_log_opacity * w.scaled * w.inverse_width - d_tau);
    store(m.row + kLogWidthRow, d_log_opacity * w.scaled * w.scaled);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace color3d {
namespace {
HWY_EXPORT(MoveRange);
HWY_EXPORT(BackwardRange);
}  // namespace

void ApplyMotion(const MotionAt& motion, ThreadPool& pool, ParameterBlock& at, float hidden) {
  const auto move_range = &COLOR3D_KERNEL(MoveRange);
  pool.ForRanges(motion.moving.blocks(), [&](int64_t begin, int64_t end, int) {
    move_range(motion, hidden, begin, end, at);
  });
}

void ApplyMotionBackward(const MotionAt& motion,
                         const ParameterBlock& at,
                         const ParameterBlock& d_at,
                         ThreadPool& pool,
                         ParameterBlock& d_moving) {
  const ParameterBlock& moving = motion.moving;
  if (!d_moving.HasShapeOf(moving)) d_moving = moving.ZerosOfSameShape();
  for (int r = 0; r < motion.row; ++r) {
    std::copy_n(d_at.Row(r) + motion.first, moving.count(), d_moving.Row(r));
  }
  const auto backward_range = &COLOR3D_KERNEL(BackwardRange);
  pool.ForRanges(moving.blocks(), [&](int64_t begin, int64_t end, int) {
    backward_range(motion, at, d_at, begin, end, d_moving);
  });
}

}  // namespace color3d
#endif  // HWY_ONCE
