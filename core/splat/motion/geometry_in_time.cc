#include "core/splat/motion/geometry_in_time.h"

#include <vector>

#include "core/splat/hexplane/hexplane.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/motion/motion.h"

namespace color3d {
namespace {

// Windows of parabolic motion.
class WindowDeformation : public Deformation {
 public:
  explicit WindowDeformation(const GaussianModel& model)
      : times_{model.motion.begin_s, model.motion.end_s, {}, {}, {}, {}, {}},
        motion_(MotionFromModel(model)) {}

  void Apply(double time_s, ThreadPool& pool, ParameterBlock& at) const override {
    ApplyMotion({motion_, 0, times_.UnitTime(time_s), at.count() - motion_.count()}, pool, at);
  }

 private:
  const GaussianMotion times_;  // begin and end alone
  const ParameterBlock motion_;
};

class HexPlaneDeformation : public Deformation {
 public:
  explicit HexPlaneDeformation(const HexPlaneField& field) : field_(field) {}

  void Apply(double time_s, ThreadPool& pool, ParameterBlock& at) const override {
    const HexPlaneShape& shape = field_.shape;
    ApplyHexPlanes(
        {shape, field_.planes.data(), field_.network.data(), shape.UnitTime(time_s)}, pool, at);
  }

 private:
  const HexPlaneField field_;
};

}  // namespace

std::unique_ptr<Deformation> DeformationOf(const GaussianModel& model) {
  if (!model.hexplane.empty()) return std::make_unique<HexPlaneDeformation>(model.hexplane);
  if (model.motion.size() > 0) return std::make_unique<WindowDeformation>(model);
  return nullptr;
}

ParameterBlock ParametersAt(const GaussianModel& model, double time_s, ThreadPool& pool) {
  ParameterBlock at = ParametersFromModel(model);
  if (const auto deformation = DeformationOf(model)) deformation->Apply(time_s, pool, at);
  return at;
}

GaussianModel ModelAt(const GaussianModel& model, double time_s, ThreadPool& pool) {
  if (!model.IsDynamic()) return model;
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
