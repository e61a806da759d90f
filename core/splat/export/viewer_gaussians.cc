#include "core/splat/export/viewer_gaussians.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

constexpr double kMaxRoundingOfExtent = 1e-3;
constexpr double kFloatHalfUlp = 0x1p-24;  // relative

void UnitRotation(const float* q, float* out) {
  const float norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const bool usable = norm > 1e-12f && std::isfinite(norm);
  for (int k = 0; k < 4; ++k) out[k] = usable ? q[k] / norm : (k == 0 ? 1.0f : 0.0f);
}

}  // namespace

ExportFrame ExportFrameOf(const Scene& scene) {
  ExportFrame frame;
  frame.scale = scene.world_from_scene_scale;
  const double extent = scene.world_from_scene_scale * scene.Extent();
  const double rounding = kFloatHalfUlp * scene.world_offset.cwiseAbs().maxCoeff();
  (rounding <= kMaxRoundingOfExtent * extent ? frame.offset : frame.left_out) = scene.world_offset;
  return frame;
}

ViewerGaussians ForViewers(const GaussianModel& model,
                           const RgbHarmonics& rgb,
                           const ExportFrame& frame,
                           ThreadPool& pool) {
  CheckModel(model);
  const size_t wanted = model.size() * static_cast<size_t>(ShCoefficients(rgb.degree)) * 3;
  if (rgb.sh.size() != wanted) {
    throw InvalidArgument("RGB harmonics have {} numbers, {} are needed; fit them to this model",
                          rgb.sh.size(),
                          wanted);
  }
  ViewerGaussians g;
  g.sh_degree = rgb.degree;
  g.position.resize(3 * model.size());
  g.log_scale.resize(3 * model.size());
  g.rotation.resize(4 * model.size());
  g.opacity_logit = model.opacity_logit;
  g.sh = rgb.sh;
  const float log_scale_shift = static_cast<float>(std::log(frame.scale));
  pool.ForRanges(static_cast<int64_t>(model.size()), [&](int64_t begin, int64_t end, int) {
    for (int64_t i = begin; i < end; ++i) {
      for (int k = 0; k < 3; ++k) {
        g.position[3 * i + k] =
            static_cast<float>(frame.scale * model.position[3 * i + k] + frame.offset[k]);
        g.log_scale[3 * i + k] = model.log_scale[3 * i + k] + log_scale_shift;
      }
      UnitRotation(model.rotation.data() + 4 * i, g.rotation.data() + 4 * i);
    }
  });
  return g;
}

void CheckFinite(const ViewerGaussians& gaussians) {
  const auto check = [&](const char* what, const std::vector<float>& values) {
    const auto bad =
        std::find_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
    if (bad == values.end()) return;
    const size_t width = values.size() / gaussians.size();
    throw InvalidArgument("the {} of Gaussian {} is not a finite number; leave such Gaussians out",
                          what,
                          static_cast<size_t>(bad - values.begin()) / width);
  };
  check("position", gaussians.position);
  check("scale", gaussians.log_scale);
  check("rotation", gaussians.rotation);
  check("opacity", gaussians.opacity_logit);
  check("color", gaussians.sh);
}

}  // namespace color3d
