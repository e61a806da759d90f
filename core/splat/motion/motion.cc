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

}  // namespace color3d
