#include "core/splat/export/splat4d/mover_frames.h"

#include <algorithm>
#include <utility>

#include "core/splat/export/bytes.h"
#include "core/splat/model/model_parameters.h"

namespace color3d {

MoverFrames::MoverFrames(const GaussianModel& model, const ExportFrame& frame, ThreadPool& pool)
    : always(model.MovingCount(), 1),
      in_time_(model, pool),
      block_(kColorRow + 1, static_cast<int64_t>(model.MovingCount())),
      colors_{0, std::vector<float>(3 * model.MovingCount(), 0.0f)},
      frame_(frame),
      pool_(pool) {
  const ParameterBlock all = ParametersFromModel(model);
  for (int row = 0; row < kColorRow; ++row) {
    std::copy_n(all.Row(row) + all.count() - block_.count(), block_.count(), block_.Row(row));
  }
}

void MoverFrames::GoTo(double time_s) {
  if (always.empty()) return;
  const ViewerGaussians at = ForViewers(
      ModelFromParameters(in_time_.At(block_, time_s), ColorLayout{}), colors_, frame_, pool_);
  CheckFinite(at);
  const std::vector<float> before = std::exchange(rotation, {});
  position = at.position;
  log_scale = at.log_scale;
  opacity.clear();
  seen.clear();
  for (size_t i = 0; i < at.size(); ++i) {
    opacity.push_back(OpacityByte(at.opacity_logit[i]));
    seen.push_back(opacity.back() > 0.0f ? 1 : 0);
    AddRotation(at.rotation.data() + 4 * i, before.empty() ? nullptr : before.data() + 4 * i);
  }
}

void MoverFrames::AddRotation(const float* unit, const float* before) {
  float dot = 0.0f;
  for (int k = 0; before != nullptr && k < 4; ++k) dot += unit[k] * before[k];
  for (int k = 0; k < 4; ++k) {
    rotation.push_back(static_cast<float>(RotationByte(dot < 0.0f ? -unit[k] : unit[k])) - 128.0f);
  }
}

}  // namespace color3d
