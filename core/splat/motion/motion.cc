#include "core/splat/motion/motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/splat/model/model_parameters.h"

namespace color3d {
namespace {

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
    ToPlanar(from, width, row, block);
  });
  return block;
}

void SetMotion(const ParameterBlock& moving, int row, GaussianMotion& motion) {
  ForEachPart(motion, [&](std::vector<float>& to, int part, int width) {
    to = FromPlanar(moving, row + part, width);
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
    ApplyMotion({MotionFromModel(model), 0, model.motion.UnitTime(time_s), still}, pool, at);
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
  GaussianModel at = ModelFromParameters(parameters, LayoutOf(model));
  for (const uint32_t i : seen) {
    if (!model.confidence.empty()) at.confidence.push_back(model.confidence[i]);
  }
  return at;
}

}  // namespace color3d
