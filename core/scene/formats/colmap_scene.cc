#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/catalogue/pose_files.h"
#include "core/catalogue/scene_files.h"
#include "core/scene/formats/colmap_model.h"
#include "core/scene/formats/reprojection.h"
#include "core/scene/formats/scene_readers.h"
#include "core/scene/frame_times.h"
#include "core/scene/named_files.h"
#include "core/scene/photos.h"
#include "core/scene/sparse_cloud.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Views of a model before their photos are looked up; image numbers by view.
struct NamedViews {
  std::vector<uint32_t> images;
  std::vector<std::string> files;    // relative to the scene's folder, one for each image
  std::vector<std::string> missing;  // names of missing photos
};

// Sets the views' moments if there is a file of times.
FrameMoments ReadMoments(const fs::path& scene_folder,
                         const NamedFiles& photos,
                         const std::vector<View>& views) {
  FrameMoments none;
  none.moments.resize(views.size());
  if (!IsFile(scene_folder / kTimesFile)) return none;
  std::map<std::string, FrameTime> time_of_file;
  {
    const std::map<std::string, FrameTime> times = LoadColmapTimes(scene_folder / kTimesFile);
    std::vector<std::string> names;
    for (const auto& [name, time] : times) names.push_back(name);
    const std::vector<std::string> files = photos.Find(names);
    for (size_t i = 0; i < names.size(); ++i) {
      const FrameTime& time = times.at(names[i]);
      const auto [other, fresh] = time_of_file.emplace(files[i], time);
      if (fresh || files[i].empty()) continue;
      throw InvalidArgument("{}: {} has a time already ({}); remove one of the two lines",
                            time.place,
                            names[i],
                            other->second.place);
    }
    time_of_file.erase("");
  }
  std::vector<FrameTime> frames;
  std::vector<std::string> without;
  for (const View& view : views) {
    const auto time = time_of_file.find(view.image_file);
    if (time != time_of_file.end()) {
      frames.push_back(time->second);
      frames.back().file = view.name;
    } else {
      without.push_back(view.name);
    }
  }
  if (frames.empty()) {
    none.note = fmt::format(
        "{} names no photo as the COLMAP model does ({}): the scene is treated as static",
        kTimesFile,
        SummarizeNames(without, 3));
    return none;
  }
  if (!without.empty()) {
    throw InvalidArgument(
        "{} has no time for {} of the COLMAP model's {} photos ({}), but {} has one; give it to "
        "every photo, or remove the file",
        kTimesFile,
        without.size(),
        views.size(),
        SummarizeNames(without, 3),
        frames[0].file);
  }
  return AssignMoments(frames);
}

// Orders views by the names of their photos, so that the result does not depend on COLMAP's
// numbers.
NamedViews MatchPhotos(const ColmapModel& model, const NamedFiles& photos) {
  std::vector<std::pair<std::string, uint32_t>> order;
  for (const auto& [id, image] : model.images) order.emplace_back(image.name, id);
  std::ranges::sort(order);
  std::vector<std::string> names;
  for (size_t i = 0; i < order.size(); ++i) {
    std::string name = order[i].first;
    std::ranges::replace(name, '\\', '/');
    while (name.starts_with("./")) name.erase(0, 2);
    if (!IsSafeRelativePath(name)) {
      throw InvalidArgument(
          "the COLMAP model names a photo \"{}\"; names must be relative paths without '..'",
          order[i].first);
    }
    if (i > 0 && order[i].first == order[i - 1].first) {
      throw InvalidArgument("the COLMAP model names the photo {} twice", name);
    }
    names.push_back(std::move(name));
  }
  NamedViews named;
  const std::vector<std::string> files = photos.Find(names);
  std::map<std::string, std::string> name_of_file;
  for (size_t i = 0; i < order.size(); ++i) {
    if (files[i].empty()) {
      named.missing.push_back(order[i].first);
      continue;
    }
    const auto [other, fresh] = name_of_file.emplace(files[i], order[i].first);
    if (!fresh) {
      throw InvalidArgument("the COLMAP model's {} and {} both fit the photo {}; rename the photos",
                            other->second,
                            order[i].first,
                            files[i]);
    }
    named.images.push_back(order[i].second);
    named.files.push_back(files[i]);
  }
  return named;
}

// Warns of photos that are left out; throws if too few remain.
void NoteMissing(const NamedViews& named, size_t total, std::vector<std::string>* warnings) {
  constexpr size_t kFewest = 2;
  if (named.images.size() < std::min(kFewest, total)) {
    throw InvalidArgument(
        "the COLMAP model names {} photos, of which {} are among those given (missing: {}); give "
        "the photos that the poses were computed from",
        total,
        named.images.size(),
        SummarizeNames(named.missing));
  }
  if (named.missing.empty() || warnings == nullptr) return;
  warnings->push_back(
      fmt::format("{} of the {} photos that the COLMAP model names are not among those given and "
                  "were left out: {}",
                  named.missing.size(),
                  total,
                  SummarizeNames(named.missing)));
}

// Points without tracks get the views whose picture they fall into.
std::vector<SparsePoint> MakePoints(const ColmapModel& model,
                                    const std::map<uint32_t, int>& view_of_image,
                                    const Scene& scene) {
  std::vector<SparsePoint> points;
  points.reserve(model.points.size());
  for (const ColmapPoint& from : model.points) {
    for (const uint32_t image_id : from.image_ids) {
      if (!model.images.contains(image_id)) {
        throw InvalidArgument("points3D refers to image {}, which the model does not have",
                              image_id);
      }
    }
    SparsePoint point = MakeSparsePoint(from, view_of_image);
    if (from.image_ids.empty()) {
      point.reprojection_error_px = -1.0;
      point.views = ViewsFacing(scene, point.position, 0.0);
    }
    points.push_back(std::move(point));
  }
  return points;
}

Scene MakeScene(const ColmapModel& model,
                const NamedViews& named,
                const NamedFiles& photos,
                const fs::path& scene_folder,
                std::vector<std::string>* warnings,
                std::vector<std::string>* cameras) {
  if (model.images.empty()) throw InvalidArgument("the COLMAP model has no images");
  NoteMissing(named, model.images.size(), warnings);
  if (warnings != nullptr) {
    const std::vector<std::string> said = ReprojectionWarnings(MeasureReprojection(model));
    warnings->insert(warnings->end(), said.begin(), said.end());
  }
  std::vector<std::pair<View, uint32_t>> views;
  for (size_t i = 0; i < named.images.size(); ++i) {
    const ColmapImage& image = model.images.at(named.images[i]);
    const ColmapCamera& camera = model.cameras.at(image.camera_id);
    View view;
    view.image_file = named.files[i];
    view.name = ViewNameOf(view.image_file);
    view.captured_camera = camera.camera;
    view.distortion = camera.distortion;
    view.cam_from_world = image.cam_from_world;
    FitViewToFile(scene_folder, &view);
    views.emplace_back(std::move(view), named.images[i]);
  }
  std::ranges::sort(views, {}, [](const auto& view) { return view.first.name; });
  Scene scene;
  std::map<uint32_t, int> view_of_image;
  for (auto& [view, image] : views) {
    view_of_image[image] = static_cast<int>(scene.views.size());
    scene.views.push_back(std::move(view));
  }
  AddMoments(ReadMoments(scene_folder, photos, scene.views), &scene, warnings, cameras);
  scene.points = MakePoints(model, view_of_image, scene);
  return scene;
}

std::string FolderText(const std::string& folder) {
  return folder.empty() ? "the scene's own folder" : folder;
}

}  // namespace

Scene ReadColmapModel(const fs::path& model_folder,
                      const fs::path& scene_folder,
                      std::vector<std::string>* warnings,
                      std::vector<std::string>* cameras) {
  const ColmapModel model = LoadColmapModel(model_folder);
  const NamedFiles photos = NamedFiles::Photos(scene_folder);
  return MakeScene(model, MatchPhotos(model, photos), photos, scene_folder, warnings, cameras);
}

std::optional<ColmapChoice> ChooseColmapModel(const fs::path& scene_folder) {
  const std::vector<ColmapPlace> places = ColmapPlaces(ListFiles(scene_folder));
  if (places.empty()) return std::nullopt;
  const NamedFiles photos = NamedFiles::Photos(scene_folder);
  std::optional<ColmapChoice> choice;
  std::optional<Error> refusal;
  std::vector<std::string> counts;
  std::vector<std::string> notes;
  for (const ColmapPlace& place : places) {
    try {
      const ColmapModel model = LoadColmapModel(scene_folder / place.folder);
      const size_t found = MatchPhotos(model, photos).images.size();
      counts.push_back(
          fmt::format("{} has {} of {}", FolderText(place.folder), found, photos.size()));
      if (!choice || found > choice->photos) choice = ColmapChoice{place.folder, found, {}};
    } catch (const Error& e) {
      if (!refusal) refusal = e;
      notes.push_back(fmt::format(
          "the COLMAP model in {} is not used: {}", FolderText(place.folder), e.what()));
    }
  }
  if (!choice) throw *refusal;
  choice->notes = std::move(notes);
  if (counts.size() > 1) {
    choice->notes.push_back(fmt::format(
        "there are {} COLMAP models; the one in {} is used, since it has most photos ({})",
        counts.size(),
        FolderText(choice->folder),
        SummarizeNames(counts, 8)));
  }
  return choice;
}

}  // namespace color3d
