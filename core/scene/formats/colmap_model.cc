#include "core/scene/formats/colmap_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/scene/formats/within_reach.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// COLMAP 3.8, src/base/camera_models.h documents the order of the parameters.
struct ModelInfo {
  const char* name;
  int parameter_count;
  bool supported;
};
constexpr std::array<ModelInfo, 11> kModels = {{{"SIMPLE_PINHOLE", 3, true},
                                                {"PINHOLE", 4, true},
                                                {"SIMPLE_RADIAL", 4, true},
                                                {"RADIAL", 5, true},
                                                {"OPENCV", 8, true},
                                                {"OPENCV_FISHEYE", 8, true},
                                                {"FULL_OPENCV", 12, true},
                                                {"FOV", 5, false},
                                                {"SIMPLE_RADIAL_FISHEYE", 4, true},
                                                {"RADIAL_FISHEYE", 5, true},
                                                {"THIN_PRISM_FISHEYE", 12, false}}};

bool HasOneFocalLength(const std::string& model) {
  return model == "SIMPLE_PINHOLE" || model == "SIMPLE_RADIAL" || model == "RADIAL" ||
         model == "SIMPLE_RADIAL_FISHEYE" || model == "RADIAL_FISHEYE";
}

bool IsFisheye(const std::string& model) { return model.find("FISHEYE") != std::string::npos; }

}  // namespace

int ColmapParameterCount(const std::string& model, const std::string& place) {
  for (const ModelInfo& info : kModels) {
    if (model != info.name) continue;
    if (!info.supported) {
      throw InvalidArgument(
          "{} has the camera model {}, which is not supported; run colmap image_undistorter first",
          place,
          model);
    }
    return info.parameter_count;
  }
  throw InvalidArgument("{} has the unknown camera model {}", place, model);
}

std::string ColmapModelName(int model_id, const std::string& place) {
  if (model_id < 0 || model_id >= static_cast<int>(kModels.size())) {
    throw InvalidArgument("{} has the unknown camera model number {}", place, model_id);
  }
  return kModels[static_cast<size_t>(model_id)].name;
}

ColmapCamera MakeColmapCamera(const std::string& model,
                              uint64_t width,
                              uint64_t height,
                              const std::vector<double>& parameters,
                              const std::string& place) {
  constexpr uint64_t kMaxSidePx = 1'000'000;
  if (width < 1 || height < 1 || width > kMaxSidePx || height > kMaxSidePx) {
    throw InvalidArgument("{} is {} x {} px", place, width, height);
  }
  if (static_cast<int>(parameters.size()) != ColmapParameterCount(model, place)) {
    throw InvalidArgument("{} has {} parameters; {} has {}",
                          place,
                          parameters.size(),
                          model,
                          ColmapParameterCount(model, place));
  }
  for (double p : parameters) {
    if (!std::isfinite(p)) throw InvalidArgument("{} has a parameter that is not finite", place);
  }
  ColmapCamera out;
  Camera& c = out.camera;
  c.width = static_cast<int>(width);
  c.height = static_cast<int>(height);
  size_t next = HasOneFocalLength(model) ? 1 : 2;
  c.fx = parameters[0];
  c.fy = parameters[next - 1];
  c.cx = parameters[next++];
  c.cy = parameters[next++];
  if (!(c.fx > 0.0 && c.fy > 0.0)) {
    throw InvalidArgument(
        "{} has a focal length of {} px; it must be positive", place, std::min(c.fx, c.fy));
  }
  // The remaining parameters are in OpenCV's order: RADIAL has k1 k2, OPENCV k1 k2 p1 p2,
  // FULL_OPENCV also k3..k6, the fisheye models have k1..k4.
  const size_t first = next;
  for (; next < parameters.size(); ++next) out.distortion.k[next - first] = parameters[next];
  if (IsFisheye(model)) {
    out.distortion.model = Distortion::Model::kFisheye;
  } else if (parameters.size() > first) {
    out.distortion.model = Distortion::Model::kBrown;
  }
  return out;
}

Pose MakeColmapPose(const double (&q)[4], const double (&t)[3], const std::string& place) {
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  const Eigen::Vector3d translation(t[0], t[1], t[2]);
  const double norm = rotation.norm();
  if (!std::isfinite(norm) || !translation.allFinite()) {
    throw InvalidArgument("{} has a pose that is not finite", place);
  }
  CheckPositionRange(translation, place);
  if (norm < 1e-6) throw InvalidArgument("{} has a zero rotation quaternion", place);
  Pose pose;
  pose.rotation = rotation.normalized();
  pose.translation = translation;
  return pose;
}

void CheckColmapName(const std::string& name, const std::string& place) {
  const bool bad = std::ranges::any_of(name, [](unsigned char c) { return c < 32 || c == 127; });
  if (bad) throw InvalidArgument("{}: the name of an image holds control characters", place);
}

void CheckColmapPoint(const ColmapPoint& point, const std::string& place) {
  for (int i = 0; i < 3; ++i) {
    const double v = point.position[i];
    if (std::isnan(v)) throw InvalidArgument("{} has a NaN coordinate", place);
    if (std::isinf(v)) throw InvalidArgument("{} has an infinite coordinate", place);
  }
}

SparsePoint MakeSparsePoint(const ColmapPoint& from, const std::map<uint32_t, int>& view_of_image) {
  std::set<int> views;
  for (const uint32_t image_id : from.image_ids) {
    const auto view = view_of_image.find(image_id);
    if (view != view_of_image.end()) views.insert(view->second);
  }
  return {from.position, from.error_px, {views.begin(), views.end()}};
}

double KnownError(double error_px) { return std::isfinite(error_px) ? error_px : -1.0; }

bool IsColmapFolder(const fs::path& folder) {
  return IsFile(folder / "cameras.bin") || IsFile(folder / "cameras.txt");
}

ColmapModel LoadColmapModel(const fs::path& folder) {
  const auto missing = [&](const std::string& ending) -> std::string {
    for (const char* part : {"cameras", "images", "points3D"}) {
      if (!IsFile(folder / (part + ending))) return part + ending;
    }
    return "";
  };
  const std::string of_binary = missing(".bin"), of_text = missing(".txt");
  const bool binary = of_binary.empty() || IsFile(folder / "cameras.bin");
  if (!binary && !IsFile(folder / "cameras.txt")) {
    throw Error(ErrorCode::kNotFound, "there is no COLMAP model (cameras.bin or cameras.txt)");
  }
  if (!of_binary.empty() && !of_text.empty()) {
    throw InvalidArgument("the COLMAP model has no {}", binary ? of_binary : of_text);
  }
  ColmapModel model = of_binary.empty() ? LoadColmapBinary(folder) : LoadColmapText(folder);
  for (const auto& [id, image] : model.images) {
    if (model.cameras.count(image.camera_id) == 0) {
      throw InvalidArgument("image {} refers to camera {}, which the model does not have",
                            image.name,
                            image.camera_id);
    }
  }
  return model;
}

}  // namespace color3d
