#include <fmt/core.h>

#include <algorithm>
#include <set>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/catalogue/scene_files.h"
#include "core/scene/formats/colmap_model.h"
#include "core/scene/formats/scene_readers.h"
#include "core/scene/frame_times.h"
#include "core/scene/photos.h"
#include "core/scene/reprojection.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

std::string FirstThree(const std::vector<std::string>& names) {
  std::string text;
  for (size_t i = 0; i < std::min<size_t>(names.size(), 3); ++i) {
    text += (i == 0 ? "" : ", ") + names[i];
  }
  return text + (names.size() > 3 ? ", ..." : "");
}

void ThrowMissing(const std::vector<std::string>& missing, size_t total, const fs::path& folder) {
  throw InvalidArgument(
      "{} of the {} photos that the COLMAP model names are not in {} ({}); put them there",
      missing.size(),
      total,
      (folder / "images").string(),
      FirstThree(missing));
}

// The views' moments, where a file tells times.
FrameMoments ReadMoments(const fs::path& scene_folder, const std::vector<View>& views) {
  FrameMoments none;
  none.moments.resize(views.size());
  std::error_code error;
  if (!fs::is_regular_file(scene_folder / kTimesFile, error)) return none;
  const std::map<std::string, FrameTime> times = LoadColmapTimes(scene_folder / kTimesFile);
  std::vector<FrameTime> frames;
  std::vector<std::string> without;
  for (const View& view : views) {
    const auto time = times.find(view.name);
    if (time != times.end()) {
      frames.push_back(time->second);
    } else {
      without.push_back(view.name);
    }
  }
  if (frames.empty()) {
    none.note = fmt::format(
        "{} names no photo as the COLMAP model does ({}): the scene is taken to stand still",
        kTimesFile,
        FirstThree(without));
    return none;
  }
  if (!without.empty()) {
    throw InvalidArgument(
        "{} has no time for {} of the COLMAP model's {} photos ({}), but {} has one; give it to "
        "every photo, or remove the file",
        kTimesFile,
        without.size(),
        views.size(),
        FirstThree(without),
        frames[0].file);
  }
  return MomentsOf(frames);
}

}  // namespace

Scene ReadColmapModel(const fs::path& model_folder,
                      const fs::path& scene_folder,
                      std::vector<std::string>* warnings,
                      std::vector<std::string>* cameras) {
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
  FrameMoments moments = ReadMoments(scene_folder, scene.views);
  for (size_t i = 0; i < scene.views.size(); ++i) scene.views[i].moment = moments.moments[i];
  if (!moments.note.empty() && warnings != nullptr) warnings->push_back(std::move(moments.note));
  if (cameras != nullptr) *cameras = std::move(moments.cameras);

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
