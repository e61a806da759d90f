#include "core/splat/import/splat_scene.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/splat/import/gray_model.h"
#include "core/splat/import/seen_gaussians.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

constexpr double kMinRadius = 1.0, kMaxRadius = 300.0;  // the rasteriser's near plane is at 0.2
constexpr double kStandardRadius = 5.0;
constexpr double kFarFromOrigin = 1e3;  // radii
constexpr size_t kPoints = 10'000;
constexpr int64_t kMiB = int64_t{1} << 20;

// Transforms to a frame suitable for float32 and the near plane; the export inverts it.
void NormalizeFrame(SplatExtent* extent, SplatScene* result) {
  const bool in_band = extent->radius >= kMinRadius && extent->radius <= kMaxRadius;
  const double scale = in_band ? 1.0 : extent->radius / kStandardRadius;
  const bool far = extent->center.cwiseAbs().maxCoeff() > kFarFromOrigin * scale;
  if (in_band && !far) return;
  const Eigen::Vector3d offset = far ? extent->center : Eigen::Vector3d(Eigen::Vector3d::Zero());
  GaussianModel& model = result->geometry;
  const auto shift = static_cast<float>(std::log(scale));
  for (size_t i = 0; i < model.position.size(); ++i) {
    model.position[i] = static_cast<float>((model.position[i] - offset[i % 3]) / scale);
    model.log_scale[i] -= shift;
  }
  extent->center = (extent->center - offset) / scale;
  extent->radius /= scale;
  result->scene.world_from_scene_scale = scale;
  result->scene.world_offset = offset;
}

void AddViews(const std::vector<SplatCamera>& cameras, Scene* scene) {
  const int digits = cameras.size() > 99 ? 3 : 2;
  for (size_t i = 0; i < cameras.size(); ++i) {
    View view;
    view.name = fmt::format("view_{:0{}}.png", i + 1, digits);
    view.image_file = view.name;
    view.camera = view.captured_camera = cameras[i].camera;
    view.cam_from_world = cameras[i].cam_from_world;
    scene->views.push_back(std::move(view));
  }
}

// Gaussians visible in at least two views, like points of structure-from-motion.
void AddPoints(const GaussianModel& model, const RunControl& run, Scene* scene) {
  std::vector<Eigen::Vector3d> points;
  for (const size_t i : SpreadSample(model, kPoints))
    points.push_back(EllipsoidOf(model, i).center);
  std::vector<std::vector<int>> seen_by(points.size());
  SeenGaussians seen(model, scene->views.front().camera, run.pool);
  for (size_t v = 0; v < scene->views.size(); ++v) {
    run.cancel.ThrowIfCancelled();
    const std::vector<char> visible = seen.Visible(scene->views[v].cam_from_world, points);
    for (size_t i = 0; i < points.size(); ++i) {
      if (visible[i] != 0) seen_by[i].push_back(static_cast<int>(v));
    }
  }
  for (size_t i = 0; i < points.size(); ++i) {
    if (seen_by[i].size() < 2) continue;
    scene->points.push_back({points[i], /*reprojection_error_px=*/0.0, std::move(seen_by[i])});
  }
}

void RequireMemory(const ViewerGaussians& splat, const std::string& name, int64_t memory_bytes) {
  const int64_t needed = static_cast<int64_t>(splat.size()) * WorkBytesPerGaussian(splat.sh_degree);
  if (needed <= memory_bytes) return;
  throw Error(ErrorCode::kResourceExhausted,
              "{} holds {} Gaussians with harmonics of degree {}: work on them takes {} MiB of "
              "memory, and {} MiB may be used, enough for {}; free memory, or thin the splat out",
              name,
              splat.size(),
              splat.sh_degree,
              needed / kMiB,
              memory_bytes / kMiB,
              memory_bytes / WorkBytesPerGaussian(splat.sh_degree));
}

}  // namespace

int64_t WorkBytesPerGaussian(int sh_degree) { return 1000 + 150 * ShCoefficients(sh_degree); }

SplatScene ImportSplat(std::string_view bytes,
                       const std::string& name,
                       const SplatViewOptions& options,
                       int64_t memory_bytes,
                       const RunControl& run) {
  options.Validate();
  SplatSource source;
  source.name = name;
  source.max_gaussians = memory_bytes / WorkBytesPerGaussian(0);
  source.remedy = fmt::format(
      "work on them takes at least {} bytes each, and {} MiB may be used: "
      "free memory, or thin the splat out",
      WorkBytesPerGaussian(0),
      memory_bytes / kMiB);
  SplatScene result;
  {
    const ViewerGaussians splat = ReadSplat(bytes, source);
    RequireMemory(splat, name, memory_bytes);
    result.gaussians = static_cast<int64_t>(splat.size());
    run.cancel.ThrowIfCancelled();
    GraySplat gray = GrayModelOf(splat, name, run.pool);
    result.geometry = std::move(gray.model);
    result.dropped = gray.dropped;
    result.had_color = gray.chroma >= kColorless;
  }
  if (result.dropped > 0) {
    result.warnings.push_back(
        fmt::format("{} of the {} Gaussians of {} have a value that is not a number and were left "
                    "out",
                    result.dropped,
                    result.gaussians,
                    name));
  }
  if (result.had_color) {
    result.warnings.push_back(fmt::format("{} is in colour; its colours were removed", name));
  }
  SplatExtent extent = FindSplatExtent(result.geometry);
  NormalizeFrame(&extent, &result);
  const std::vector<SplatCamera> cameras =
      ChooseSplatCameras(result.geometry, extent, options, run);
  if (cameras.size() < 2) {
    throw InvalidArgument("only one position shows enough of {}; at least 2 views are needed",
                          name);
  }
  if (static_cast<int>(cameras.size()) < options.views) {
    result.warnings.push_back(fmt::format(
        "{} views of the splat are used: no others of the {} requested ones show enough of it",
        cameras.size(),
        options.views));
  }
  AddViews(cameras, &result.scene);
  AddPoints(result.geometry, run, &result.scene);
  return result;
}

}  // namespace color3d
