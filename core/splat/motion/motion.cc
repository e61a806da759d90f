#include "core/splat/motion/motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/splat/model/model_parameters.h"

namespace color3d {
namespace {

// Opacity below which a Gaussian is not drawn anyway, and its logit.
constexpr float kUnseenOpacity = 1e-4f;
const float kUnseenLogit = std::log(kUnseenOpacity / (1.0f - kUnseenOpacity));
constexpr float kMaxOpacity = 1.0f - 1e-6f;

float Sigmoid(float x) { return 1.0f / (1.0f + std::exp(-x)); }

// Of a window; narrower ones are taken to be so wide, so that no product overflows.
constexpr float kLeastLogWidth = -40.0f;
constexpr float kFarthest = 1e4f;  // of tau / width: nothing is seen long before

struct Window {
  float tau = 0.0f;
  float inverse_width = 0.0f;
  float scaled = 0.0f;  // tau / width
  float value = 1.0f;   // 0..1
};

Window WindowAt(const ParameterBlock& moving, int row, int64_t i, float t) {
  Window w;
  w.tau = t - moving.Row(row + kCenterRow)[i];
  w.inverse_width = std::exp(-std::max(moving.Row(row + kLogWidthRow)[i], kLeastLogWidth));
  w.scaled = std::clamp(w.tau * w.inverse_width, -kFarthest, kFarthest);
  w.value = std::exp(-0.5f * w.scaled * w.scaled);
  return w;
}

// visit(buffer, row, width) of a GaussianMotion.
template <class Motion, class Visit>
void ForEachPart(Motion& motion, Visit&& visit) {
  visit(motion.velocity, kVelocityRow, 3);
  visit(motion.acceleration, kAccelerationRow, 3);
  visit(motion.spin, kSpinRow, 4);
  visit(motion.center, kCenterRow, 1);
  visit(motion.log_width, kLogWidthRow, 1);
}

}  // namespace

float GaussianMotion::UnitTime(double time_s) const {
  const double span = end_s - begin_s;
  return span > 0.0 ? static_cast<float>(2.0 * (time_s - begin_s) / span - 1.0) : 0.0f;
}

ParameterBlock MotionFromModel(const GaussianModel& model) {
  ParameterBlock block(kMotionRows, static_cast<int64_t>(model.motion.size()));
  ForEachPart(model.motion, [&](const std::vector<float>& from, int row, int width) {
    for (int k = 0; k < width; ++k) {
      float* out = block.Row(row + k);
      for (int64_t i = 0; i < block.count(); ++i) out[i] = from[i * width + k];
    }
  });
  return block;
}

void SetMotion(const ParameterBlock& moving, int row, GaussianMotion& motion) {
  ForEachPart(motion, [&](std::vector<float>& to, int part, int width) {
    to.resize(static_cast<size_t>(moving.count()) * width);
    for (int k = 0; k < width; ++k) {
      const float* in = moving.Row(row + part + k);
      for (int64_t i = 0; i < moving.count(); ++i) to[i * width + k] = in[i];
    }
  });
}

void ApplyMotion(const ParameterBlock& moving,
                 int row,
                 float t,
                 int64_t first,
                 ThreadPool& pool,
                 ParameterBlock& at,
                 float hidden) {
  pool.ForRanges(moving.count(), [&](int64_t begin, int64_t end, int) {
    for (int64_t i = begin; i < end; ++i) {
      const Window w = WindowAt(moving, row, i, t);
      const int64_t j = first + i;
      for (int k = 0; k < 3; ++k) {
        at.Row(kPositionRow + k)[j] += w.tau * (moving.Row(row + kVelocityRow + k)[i] +
                                                w.tau * moving.Row(row + kAccelerationRow + k)[i]);
      }
      for (int k = 0; k < 4; ++k) {
        at.Row(kRotationRow + k)[j] += w.tau * moving.Row(row + kSpinRow + k)[i];
      }
      float& logit = at.Row(kOpacityRow)[j];
      if (std::abs(w.tau) < hidden) {
        logit = kUnseenLogit;
        continue;
      }
      const float opacity = std::min(Sigmoid(logit) * w.value, kMaxOpacity);
      logit = opacity > kUnseenOpacity ? std::log(opacity / (1.0f - opacity)) : kUnseenLogit;
    }
  });
}

void ApplyMotionBackward(const ParameterBlock& moving,
                         int row,
                         float t,
                         int64_t first,
                         const ParameterBlock& at,
                         const ParameterBlock& d_at,
                         ThreadPool& pool,
                         ParameterBlock& d_moving) {
  if (d_moving.rows() != moving.rows() || d_moving.count() != moving.count()) {
    d_moving = ParameterBlock(moving.rows(), moving.count());
  }
  for (int r = 0; r < row; ++r) {
    std::copy_n(d_at.Row(r) + first, moving.count(), d_moving.Row(r));
  }
  pool.ForRanges(moving.count(), [&](int64_t begin, int64_t end, int) {
    for (int64_t i = begin; i < end; ++i) {
      const Window w = WindowAt(moving, row, i, t);
      const int64_t j = first + i;
      float d_tau = 0.0f;
      for (int k = 0; k < 3; ++k) {
        const float d = d_at.Row(kPositionRow + k)[j];
        d_moving.Row(row + kVelocityRow + k)[i] = w.tau * d;
        d_moving.Row(row + kAccelerationRow + k)[i] = w.tau * w.tau * d;
        d_tau += d * (moving.Row(row + kVelocityRow + k)[i] +
                      2.0f * w.tau * moving.Row(row + kAccelerationRow + k)[i]);
      }
      for (int k = 0; k < 4; ++k) {
        const float d = d_at.Row(kRotationRow + k)[j];
        d_moving.Row(row + kSpinRow + k)[i] = w.tau * d;
        d_tau += d * moving.Row(row + kSpinRow + k)[i];
      }
      // dL/d logit at t is dL/d opacity times opacity (1 - opacity); what is not drawn has none.
      const float d_logit = d_at.Row(kOpacityRow)[j];
      const float rest = 1.0f - Sigmoid(at.Row(kOpacityRow)[j]);
      const float d_log_opacity = rest > 0.0f ? d_logit / rest : 0.0f;
      d_moving.Row(kOpacityRow)[i] = d_log_opacity * (1.0f - Sigmoid(moving.Row(kOpacityRow)[i]));
      d_moving.Row(row + kCenterRow)[i] = d_log_opacity * w.scaled * w.inverse_width - d_tau;
      d_moving.Row(row + kLogWidthRow)[i] = d_log_opacity * w.scaled * w.scaled;
    }
  });
}

void LimitWindows(float least, int row, ParameterBlock& moving) {
  float* width = moving.Row(row + kLogWidthRow);
  for (int64_t i = 0; i < moving.count(); ++i) width[i] = std::max(width[i], least);
}

ParameterBlock ParametersAt(const GaussianModel& model, double time_s, ThreadPool& pool) {
  ParameterBlock at = ParametersFromModel(model);
  if (model.motion.size() > 0) {
    const auto still = static_cast<int64_t>(model.size() - model.motion.size());
    ApplyMotion(MotionFromModel(model), 0, model.motion.UnitTime(time_s), still, pool, at);
  }
  return at;
}

GaussianModel ModelAt(const GaussianModel& model, double time_s, ThreadPool& pool) {
  if (model.motion.size() == 0) return model;
  ParameterBlock parameters = ParametersAt(model, time_s, pool);
  std::vector<uint32_t> seen;
  for (int64_t i = 0; i < parameters.count(); ++i) {
    if (parameters.Row(kOpacityRow)[i] > kUnseenLogit) seen.push_back(static_cast<uint32_t>(i));
  }
  parameters.Gather(seen);
  GaussianModel at =
      ModelFromParameters(parameters, model.channels, model.sh_degree, model.chroma_sh_degree);
  for (const uint32_t i : seen) {
    if (!model.confidence.empty()) at.confidence.push_back(model.confidence[i]);
  }
  return at;
}

}  // namespace color3d
