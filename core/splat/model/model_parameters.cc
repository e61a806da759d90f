#include "core/splat/model/model_parameters.h"

#include "core/base/error.h"
#include "core/splat/model/model_buffers.h"

namespace color3d {
void ToPlanar(const std::vector<float>& from, int width, int row, ParameterBlock& to) {
  for (int k = 0; k < width; ++k) {
    float* out = to.Row(row + k);
    for (int64_t i = 0; i < to.count(); ++i) out[i] = from[i * width + k];
  }
}

std::vector<float> FromPlanar(const ParameterBlock& from, int row, int width) {
  std::vector<float> to(static_cast<size_t>(from.count()) * width);
  for (int k = 0; k < width; ++k) {
    const float* in = from.Row(row + k);
    for (int64_t i = 0; i < from.count(); ++i) to[i * width + k] = in[i];
  }
  return to;
}

void CheckModel(const GaussianModel& model) {
  if (model.channels != 1 && model.channels != 3) {
    throw InvalidArgument("Gaussian model: {} channels; 1 or 3 are possible", model.channels);
  }
  if (model.color_space == ColorSpace::kSrgb && model.channels != 3) {
    throw InvalidArgument("Gaussian model: {} channel in sRGB; 3 are needed", model.channels);
  }
  if (model.sh_degree < 0 || model.sh_degree > 3 || model.chroma_sh_degree < 0 ||
      model.chroma_sh_degree > 3) {
    throw InvalidArgument(
        "Gaussian model: spherical harmonics of degree {} and {}; 0 to 3 are possible",
        model.sh_degree,
        model.chroma_sh_degree);
  }
  const GaussianMotion& motion = model.motion;
  if (motion.size() > model.size() || !(motion.begin_s <= motion.end_s)) {
    throw InvalidArgument(
        "Gaussian model: motion of {} Gaussians out of {}, from {} s to {} s, is invalid",
        motion.size(),
        model.size(),
        motion.begin_s,
        motion.end_s);
  }
  const HexPlaneField& field = model.hexplane;
  if (!field.empty()) {
    const std::string complaint =
        motion.size() > 0 ? "there is motion, too" : field.shape.Complaint();
    if (!complaint.empty()) {
      throw InvalidArgument("Gaussian model: the deformation field is invalid: {}", complaint);
    }
    if (field.planes.size() != field.shape.PlaneFloats() ||
        field.network.size() != field.shape.NetworkFloats()) {
      throw InvalidArgument(
          "Gaussian model: the deformation field has {} numbers of planes and {} of the network, "
          "{} and {} are needed",
          field.planes.size(),
          field.network.size(),
          field.shape.PlaneFloats(),
          field.shape.NetworkFloats());
    }
  }
  const auto check = [](const char* name, const auto& buffer, int width, size_t count) {
    const size_t needed = count * static_cast<size_t>(width);
    if (buffer.size() == needed) return;
    throw InvalidArgument(
        "Gaussian model: {} has {} numbers, {} are needed", name, buffer.size(), needed);
  };
  ForEachBuffer(model, model.size(), motion.size(), !model.confidence.empty(), check);
  for (size_t i = 0; i < model.confidence.size(); ++i) {
    if (model.confidence[i] >= 0.0f && model.confidence[i] <= 1.0f) continue;
    throw InvalidArgument("Gaussian model: confidence of Gaussian {} is {}; it must be 0 to 1",
                          i,
                          model.confidence[i]);
  }
}

ParameterBlock ParametersFromModel(const GaussianModel& model) {
  CheckModel(model);
  const int luminance = ShCoefficients(model.sh_degree);
  const int chroma = model.channels == 3 ? ShCoefficients(model.chroma_sh_degree) : 0;
  ParameterBlock p(kColorRow + luminance + 2 * chroma, static_cast<int64_t>(model.size()));
  ToPlanar(model.position, 3, kPositionRow, p);
  ToPlanar(model.log_scale, 3, kLogScaleRow, p);
  ToPlanar(model.rotation, 4, kRotationRow, p);
  ToPlanar(model.opacity_logit, 1, kOpacityRow, p);
  ToPlanar(model.sh_l, luminance, kColorRow, p);
  ToPlanar(model.sh_a, chroma, kColorRow + luminance, p);
  ToPlanar(model.sh_b, chroma, kColorRow + luminance + chroma, p);
  return p;
}

GaussianModel ModelFromParameters(const ParameterBlock& parameters, const ColorLayout& layout) {
  const int luminance = layout.Coefficients(0);
  const int chroma = layout.channels == 3 ? layout.Coefficients(1) : 0;
  GaussianModel model;
  model.color_space = layout.space;
  model.channels = layout.channels;
  model.sh_degree = layout.sh_degree;
  model.chroma_sh_degree = layout.chroma_sh_degree;
  model.position = FromPlanar(parameters, kPositionRow, 3);
  model.log_scale = FromPlanar(parameters, kLogScaleRow, 3);
  model.rotation = FromPlanar(parameters, kRotationRow, 4);
  model.opacity_logit = FromPlanar(parameters, kOpacityRow, 1);
  model.sh_l = FromPlanar(parameters, kColorRow, luminance);
  model.sh_a = FromPlanar(parameters, kColorRow + luminance, chroma);
  model.sh_b = FromPlanar(parameters, kColorRow + luminance + chroma, chroma);
  return model;
}

}  // namespace color3d
