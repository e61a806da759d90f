#include "core/scene/formats/poses_bounds.h"

#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/catalogue/scene_files.h"
#include "core/scene/formats/given_points.h"
#include "core/scene/formats/npy.h"
#include "core/scene/formats/scene_readers.h"
#include "core/scene/formats/within_reach.h"
#include "core/scene/photos.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr size_t kColumns = 17;
constexpr size_t kMaxValues = 17 * 10'000;
constexpr double kMaxSidePx = 1e6;

View MakeView(const double* row, const std::string& place) {
  const auto column = [&](int c) -> Eigen::Vector3d { return {row[c], row[5 + c], row[10 + c]}; };
  Eigen::Matrix3d world_from_cam;  // x right, y down, z forward
  world_from_cam << column(1), column(0), -column(2);
  const double determinant = world_from_cam.determinant();
  if (!(std::abs(determinant - 1.0) < 1e-2) ||
      !(world_from_cam.transpose() * world_from_cam).isApprox(Eigen::Matrix3d::Identity(), 1e-2)) {
    throw InvalidArgument("{}: its axes are not a rotation (determinant {:g})", place, determinant);
  }
  const Eigen::Vector3d size_and_focal = column(4);
  const double height = size_and_focal[0], width = size_and_focal[1], focal = size_and_focal[2];
  if (!(width >= 1.0 && height >= 1.0 && width <= kMaxSidePx && height <= kMaxSidePx &&
        focal > 0.0 && focal < 1e9)) {
    throw InvalidArgument("{}: {:g} x {:g} px with a focal length of {:g} px is no camera",
                          place,
                          width,
                          height,
                          focal);
  }
  CheckPositionRange(column(3), place);
  View view;
  view.captured_camera = {static_cast<int>(std::lround(width)),
                          static_cast<int>(std::lround(height)),
                          focal,
                          focal,
                          0.5 * width,
                          0.5 * height};
  const Eigen::Matrix3d rotation = NearestRotation(world_from_cam);
  view.cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::Matrix3d(rotation.transpose())).normalized();
  view.cam_from_world.translation = -(view.cam_from_world.rotation * column(3));
  return view;
}

NpyArray ReadRows(const fs::path& scene_folder) {
  NpyArray poses = ReadNpy(ReadFile(scene_folder / kPosesBounds), kPosesBounds, kMaxValues);
  if (poses.shape.size() != 2 || poses.shape[1] != kColumns) {
    throw InvalidArgument("{} must have {} columns (LLFF)", kPosesBounds, kColumns);
  }
  return poses;
}

}  // namespace

std::optional<Scene> ReadPosesOfPhotos(const fs::path& scene_folder,
                                       std::vector<std::string>* warnings) {
  if (!IsFile(scene_folder / kPosesBounds)) return std::nullopt;
  const NpyArray poses = ReadRows(scene_folder);
  const std::vector<Photo> photos = ListPhotos(scene_folder);
  if (poses.shape[0] != photos.size()) {
    if (warnings != nullptr) {
      warnings->push_back(
          fmt::format("{} has the poses of {} photos and names none, but there are {}, so that its "
                      "poses are not used; give all the photos that it was made from to use them",
                      kPosesBounds,
                      poses.shape[0],
                      photos.size()));
    }
    return std::nullopt;
  }
  Scene scene;
  for (size_t i = 0; i < photos.size(); ++i) {
    View view = MakeView(&poses.values[i * kColumns], fmt::format("{}: row {}", kPosesBounds, i));
    view.name = photos[i].name;
    view.image_file = photos[i].file;
    FitViewToFile(scene_folder, &view);
    scene.views.push_back(std::move(view));
  }
  scene.points =
      ReadGivenPoints(nlohmann::json::object(), kPosesBounds, scene_folder, scene, warnings);
  return scene;
}

std::vector<CameraFilm> ReadPosesBounds(const fs::path& scene_folder) {
  std::vector<std::string> files;
  for (const std::string& file : ListFiles(scene_folder)) {
    if (HasFilmExtension(file) && file.find('/') == std::string::npos) files.push_back(file);
  }
  if (files.empty()) return {};
  std::ranges::sort(files);
  const NpyArray poses = ReadRows(scene_folder);
  if (poses.shape[0] != files.size()) {
    throw InvalidArgument(
        "{} has the poses of {} cameras, but there are {} films ({} to {}); give one film for each "
        "row",
        kPosesBounds,
        poses.shape[0],
        files.size(),
        files.front(),
        files.back());
  }
  std::vector<CameraFilm> films;
  for (size_t i = 0; i < files.size(); ++i) {
    const std::string place = fmt::format("{}: row {}", kPosesBounds, i);
    films.push_back({fs::path(files[i]).stem().string(),
                     files[i],
                     MakeView(&poses.values[i * kColumns], place)});
  }
  return films;
}

}  // namespace color3d
