#include <algorithm>
#include <set>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/scene/formats/colmap_model.h"
#include "core/scene/formats/scene_readers.h"
#include "core/scene/photos.h"
#include "core/scene/reprojection.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

void ThrowMissing(const std::vector<std::string>& missing, size_t total, const fs::path& folder) {
  std::string names;
  for (size_t i = 0; i < std::min<size_t>(missing.size(), 3); ++i) {
    names += (i == 0 ? "" : ", ") + missing[i];
  }
  throw InvalidArgument(
      "{} of the {} photos that the COLMAP model names are not in {} ({}{}); put them there",
      missing.size(),
      total,
      (folder / "images").string(),
      names,
      missing.size() > 3 ? ", ..." : "");
}

}  // namespace

Scene ReadColmapModel(const fs::path& model_folder,
                      const fs::path& scene_folder,
                      std::vector<std::string>* warnings) {
  const ColmapModel model = LoadColmapModel(model_folder);
  const std::vector<CameraReprojection> reprojection = MeasureReprojection(model);
  if (warnings != nullptr) {
    const std::vector<std::string> said = ReprojectionWarnings(reprojection);
    warnings->insert(warnings->end(), said.begin(), said.end());
  }
  if (model.images.empty()) {
    throw InvalidArgument("the COLMAP model in {} has no images", model_folder.string());
  }
  // By name, so that view order does not depend on the numbers that COLMAP gave.
  std::vector<std::pair<std::string, uint32_t>> order;
  for (const auto& [id, image] : model.images) order.emplace_back(image.name, id);
  std::sort(order.begin(), order.end());

  Scene scene;
  std::map<uint32_t, int> view_of_image;
  std::vector<std::string> missing;
  for (const auto& [name, id] : order) {
    if (!IsSafeRelativePath(name)) {
      throw InvalidArgument(
          "the COLMAP model names a photo \"{}\"; names must be relative paths without '..'", name);
    }
    if (!scene.views.empty() && scene.views.back().name == name) {
      throw InvalidArgument("the COLMAP model names the photo {} twice", name);
    }
    const ColmapImage& image = model.images.at(id);
    const ColmapCamera& camera = model.cameras.at(image.camera_id);
    View view;
    view.name = name;
    view.image_file = FindPhotoFile(scene_folder, name, false);
    if (view.image_file.empty()) {
      missing.push_back(name);
      continue;
    }
    view.captured_camera = camera.camera;
    view.distortion = camera.distortion;
    view.cam_from_world = image.cam_from_world;
    Photo photo{name, view.image_file};
    ProbePhoto(scene_folder, &photo);
    FitViewToPhoto(photo, &view);
    view_of_image[id] = static_cast<int>(scene.views.size());
    scene.views.push_back(std::move(view));
  }
  if (!missing.empty()) ThrowMissing(missing, order.size(), scene_folder);

  scene.points.reserve(model.points.size());
  for (const ColmapPoint& from : model.points) {
    SparsePoint point;
    point.position = from.position;
    point.reprojection_error_px = from.error_px;
    std::set<int> views;
    for (uint32_t image_id : from.image_ids) {
      const auto it = view_of_image.find(image_id);
      if (it == view_of_image.end()) {
        throw InvalidArgument("points3D refers to image {}, which the model does not have",
                              image_id);
      }
      views.insert(it->second);
    }
    point.views.assign(views.begin(), views.end());
    scene.points.push_back(std::move(point));
  }
  return scene;
}

}  // namespace color3d
