#include "core/scene/formats/reprojection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <unordered_map>

#include "core/scene/lens.h"

namespace color3d {
namespace {

constexpr double kLargeMedianPx = 2.0;
constexpr double kTimesTheOthers = 4.0;
constexpr double kMinSuspiciousPx = 0.5;
constexpr int64_t kMinObservations = 20;
constexpr size_t kNamedPhotos = 3;

double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// For a point behind the camera, the error is the diagonal of the picture.
double DistancePx(const ColmapCamera& camera,
                  const Eigen::Vector3d& in_camera,
                  const Eigen::Vector2d& seen) {
  const double diagonal = std::hypot(camera.camera.width, camera.camera.height);
  if (!(in_camera.z() > 0.0)) return diagonal;
  const double distance =
      (ProjectCaptured(camera.camera, camera.distortion, in_camera) - seen).norm();
  return std::isfinite(distance) ? std::min(distance, diagonal) : diagonal;
}

}  // namespace

std::vector<CameraReprojection> MeasureReprojection(const ColmapModel& model) {
  std::unordered_map<int64_t, const ColmapPoint*> point_of;
  for (const ColmapPoint& point : model.points) point_of[static_cast<int64_t>(point.id)] = &point;
  std::map<uint32_t, CameraReprojection> result;
  std::map<uint32_t, std::vector<double>> distances;
  for (const auto& [id, image] : model.images) {
    CameraReprojection& camera = result[image.camera_id];
    camera.camera_id = image.camera_id;
    camera.photos.push_back(image.name);
    for (const ColmapObservation& observation : image.observations) {
      if (observation.point_id < 0 || !observation.pixel.allFinite()) continue;
      const auto found = point_of.find(observation.point_id);
      if (found == point_of.end()) continue;
      const double distance = DistancePx(model.cameras.at(image.camera_id),
                                         image.cam_from_world.Apply(found->second->position),
                                         observation.pixel);
      distances[image.camera_id].push_back(distance);
      camera.mean_px += distance;
      ++camera.observations;
    }
  }
  std::vector<CameraReprojection> cameras;
  for (auto& [id, camera] : result) {
    if (camera.observations > 0) camera.mean_px /= static_cast<double>(camera.observations);
    camera.median_px = Median(std::move(distances[id]));
    std::ranges::sort(camera.photos);
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

std::vector<std::string> ReprojectionWarnings(const std::vector<CameraReprojection>& cameras) {
  std::vector<std::string> warnings;
  for (const CameraReprojection& camera : cameras) {
    if (camera.observations < kMinObservations) continue;
    std::vector<double> others;
    for (const CameraReprojection& other : cameras) {
      if (&other != &camera && other.observations >= kMinObservations) {
        others.push_back(other.median_px);
      }
    }
    const double usual = Median(others);
    const bool stands_out = !others.empty() && camera.median_px > kTimesTheOthers * usual &&
                            camera.median_px > kMinSuspiciousPx;
    if (camera.median_px <= kLargeMedianPx && !stands_out) continue;
    const std::span named(camera.photos.data(), std::min(camera.photos.size(), kNamedPhotos));
    warnings.push_back(fmt::format(
        "the intrinsics of camera {} ({}{}) do not fit its photos: points project {:.2f} px from "
        "where they are seen (median; mean {:.2f} px{}); check focal length and distortion, or "
        "give the photos without poses",
        camera.camera_id,
        fmt::join(named, ", "),
        camera.photos.size() > kNamedPhotos ? ", ..." : "",
        camera.median_px,
        camera.mean_px,
        others.empty() ? "" : fmt::format("; other cameras {:.2f} px", usual)));
  }
  return warnings;
}

}  // namespace color3d
