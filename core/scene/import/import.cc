#include "core/scene/import/import.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/catalogue/scene_files.h"
#include "core/image/probe/probe.h"
#include "core/scene/formats/nerfies.h"
#include "core/scene/formats/scene_readers.h"
#include "core/scene/import/hold_out.h"
#include "core/scene/import/normalise.h"
#include "core/scene/import/picture_notes.h"
#include "core/scene/key_photo.h"
#include "core/scene/lens.h"
#include "core/scene/named_files.h"
#include "core/scene/photo_masks.h"
#include "core/scene/photos.h"
#include "core/scene/sfm/sfm.h"
#include "core/scene/sparse_cloud.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr double kSuspiciousShareBehind = 0.2;
constexpr int kRandomPoints = 20'000;
constexpr uint64_t kRandomPointSeed = 1;
constexpr int kHoldOutEvery = 8;
constexpr size_t kMinTrainingViews = 2;

// If no point would be left, e.g. because most photos that saw the points were removed, points get
// the views whose picture they fall into.
void DropWeakPoints(Scene* scene) {
  auto weak = [](const SparsePoint& point) { return point.views.size() < 2; };
  if (std::ranges::all_of(scene->points, weak)) {
    for (SparsePoint& point : scene->points) {
      if (point.position.allFinite()) point.views = ViewsFacing(*scene, point.position, 0.0);
    }
  }
  scene->points.erase(std::remove_if(scene->points.begin(), scene->points.end(), weak),
                      scene->points.end());
}

void AddRandomPointsWhenEmpty(ImportResult* result) {
  Scene& scene = result->scene;
  if (!scene.points.empty()) return;
  scene.points = RandomPoints(scene, kRandomPoints, kRandomPointSeed);
  if (scene.points.empty()) {
    throw InvalidArgument(
        "the scene has no sparse points, and its cameras look at nothing in common; check the "
        "poses");
  }
  result->random_points = true;
  result->warnings.push_back(fmt::format(
      "the scene has poses but no sparse points; reconstruction starts from {} random ones",
      scene.points.size()));
}

void Normalise(ImportResult* result) {
  for (std::string& note : NormaliseScene(&result->scene)) {
    result->warnings.push_back(std::move(note));
  }
  const double behind = ShareBehindCameras(result->scene);
  if (behind > kSuspiciousShareBehind) {
    result->warnings.push_back(fmt::format(
        "{} % of the observations of sparse points lie behind their camera; check the poses",
        std::lround(100.0 * behind)));
  }
}

// Finds the masks of the photos, before structure-from-motion, and refuses bad ones.
void FindPhotoMasks(const fs::path& scene_folder,
                    const CancellationToken& cancel,
                    std::vector<Photo>* photos,
                    std::vector<std::string>* warnings) {
  std::vector<std::string> files;
  for (const Photo& photo : *photos) files.push_back(photo.file);
  const std::vector<std::string> masks = FindMasks(scene_folder, files, {}, warnings);
  for (size_t i = 0; i < masks.size(); ++i) {
    cancel.ThrowIfCancelled();
    Photo& photo = (*photos)[i];
    photo.mask_file = masks[i];
    if (!masks[i].empty()) {
      ReadMask(scene_folder, masks[i], photo.file, photo.width, photo.height);
    }
  }
}

// The same for a scene with poses.
void FindViewMasks(const fs::path& scene_folder,
                   const CancellationToken& cancel,
                   std::vector<View>* views,
                   std::vector<std::string>* warnings) {
  std::vector<std::string> files, others;
  for (const View& view : *views) files.push_back(view.image_file);
  for (const Photo& photo : ListPhotos(scene_folder)) others.push_back(photo.file);
  const std::vector<std::string> masks = FindMasks(scene_folder, files, others, warnings);
  for (size_t i = 0; i < masks.size(); ++i) {
    cancel.ThrowIfCancelled();
    View& view = (*views)[i];
    view.mask_file = masks[i];
    if (masks[i].empty()) continue;
    const Camera& camera = view.captured_camera;
    ReadMask(scene_folder, masks[i], view.image_file, camera.width, camera.height);
  }
}

void RequireMemory(const ImportOptions& options, const std::string& file, int width, int height) {
  if (options.memory_bytes > 0) RequireKeyViewMemory(file, width, height, options.memory_bytes);
}

void RequireMemory(const ImportOptions& options, const Scene& scene) {
  for (const View& view : scene.views) {
    const Camera& camera = view.captured_camera;
    RequireMemory(options, view.image_file, camera.width, camera.height);
  }
}

// A photo whose camera is not known.
View UnplacedView(const Photo& photo) {
  View view;
  view.name = photo.name;
  view.image_file = photo.file;
  view.mask_file = photo.mask_file;
  view.camera = view.captured_camera = GuessedCamera(photo.width, photo.height);
  return view;
}

Scene PicturesOf(const std::vector<Photo>& photos) {
  Scene scene;
  scene.are_pictures = true;
  for (const Photo& photo : photos) scene.views.push_back(UnplacedView(photo));
  return scene;
}

// The photos that are no views.
std::vector<Photo> UnplacedPhotos(const std::vector<Photo>& photos, const Scene& scene) {
  std::vector<std::string> files;
  for (const View& view : scene.views) files.push_back(view.image_file);
  std::ranges::sort(files);
  std::vector<Photo> unplaced;
  for (const Photo& photo : photos) {
    if (!std::ranges::binary_search(files, photo.file)) unplaced.push_back(photo);
  }
  return unplaced;
}

std::vector<std::string> NamesOf(const std::vector<View>& views) {
  std::vector<std::string> names;
  for (const View& view : views) names.push_back(view.name);
  return names;
}

constexpr char kUnplaced[] = "coloured as pictures, but are not part of the 3D scene";

// Errors that say that the cameras cannot be found in these photos.
bool IsAboutCameras(const Error& error) {
  return error.code() == ErrorCode::kInvalidArgument ||
         error.code() == ErrorCode::kDeadlineExceeded;
}

void ImportPhotos(const fs::path& scene_folder,
                  const fs::path& scratch_folder,
                  const ImportOptions& options,
                  const RunControl& run,
                  ImportResult* result) {
  std::vector<Photo> photos = ListPhotos(scene_folder);
  result->photos_found = static_cast<int>(photos.size());
  if (photos.empty()) {
    throw InvalidArgument("the scene contains no photographs ({})", ReadableImageFormats());
  }
  for (size_t i = 0; i < photos.size(); ++i) {
    run.cancel.ThrowIfCancelled();
    run.progress.OnProgress(
        static_cast<int64_t>(i), static_cast<int64_t>(photos.size()), "checking photos");
    ProbePhoto(scene_folder, &photos[i]);
    RequireMemory(options, photos[i].file, photos[i].width, photos[i].height);
  }
  if (photos.size() == 1) {
    throw InvalidArgument(
        "the scene contains one photograph ({}); at least 3 photos from different places are "
        "needed",
        photos[0].name);
  }
  FindPhotoMasks(scene_folder, run.cancel, &photos, &result->warnings);
  SfmResult sfm;
  try {
    sfm = RunStructureFromMotion(photos, scene_folder, scratch_folder, options, run);
  } catch (const Error& error) {
    if (!IsAboutCameras(error)) throw;
    result->warnings.push_back(
        fmt::format("the photos are coloured as pictures, without a 3D scene: {}", error.what()));
    result->scene = PicturesOf(photos);
    return;
  }
  result->scene = std::move(sfm.scene);
  result->sfm = std::move(sfm.report);
  result->ran_structure_from_motion = true;
  Scene& scene = result->scene;
  for (const Photo& photo : UnplacedPhotos(photos, scene)) {
    scene.unplaced.push_back(UnplacedView(photo));
  }
  if (scene.unplaced.empty()) return;
  const bool few = 2 * scene.views.size() < photos.size();
  result->warnings.push_back(
      fmt::format("{}{} of {} photos could be placed; the others share too few features with them. "
                  "They are {}: {}",
                  few ? "only " : "",
                  scene.views.size(),
                  photos.size(),
                  kUnplaced,
                  SummarizeNames(NamesOf(scene.unplaced))));
}

// Reads the photo's size. Returns false if that fails.
bool CanBeRead(const fs::path& scene_folder, Photo* photo) {
  try {
    ProbePhoto(scene_folder, photo);
  } catch (const Error&) {
    return false;
  }
  return true;
}

// Adds the photos without a pose as unplaced ones. Those of scenes with times and those that cannot
// be read are left out.
void AddUnposedPhotos(const fs::path& scene_folder, ImportResult* result) {
  const std::vector<Photo> photos = ListPhotos(scene_folder);
  Scene& scene = result->scene;
  result->photos_found = static_cast<int>(std::max(photos.size(), scene.views.size()));
  const bool has_times = scene.HasTimes();
  std::vector<std::string> left_out;
  for (Photo& photo : UnplacedPhotos(photos, scene)) {
    if (!has_times && CanBeRead(scene_folder, &photo)) {
      scene.unplaced.push_back(UnplacedView(photo));
    } else {
      left_out.push_back(photo.name);
    }
  }
  const auto warn = [&](const std::vector<std::string>& names, const char* what) {
    if (names.empty()) return;
    result->warnings.push_back(fmt::format(
        "{} photos have no pose. They are {}: {}", names.size(), what, SummarizeNames(names)));
  };
  warn(NamesOf(scene.unplaced), kUnplaced);
  warn(left_out, "left out");
}

// Reads the poses beside the photos: of the format that places most of them, COLMAP's if no other
// places more. Returns false if there are none.
bool ImportPoses(const fs::path& scene_folder, ImportResult* result) {
  const std::optional<ColmapChoice> colmap = ChooseColmapModel(scene_folder);
  const bool is_nerfies = IsNerfiesFolder(scene_folder);
  const std::vector<fs::path> transforms = TransformsFiles(scene_folder);
  if (colmap) {
    const size_t others =
        is_nerfies || transforms.empty() ? 0 : CountTransformsPhotos(transforms, scene_folder);
    if (colmap->photos >= others) {
      result->layout = CaptureLayout::kColmap;
      result->warnings = colmap->notes;
      result->scene = ReadColmapModel(
          scene_folder / colmap->folder, scene_folder, &result->warnings, &result->cameras);
      AddUnposedPhotos(scene_folder, result);
      return true;
    }
    result->warnings.push_back(
        fmt::format("{} is used: it has the poses of {} photos, the COLMAP model in {} of {}",
                    transforms[0].filename().string(),
                    others,
                    colmap->folder.empty() ? "the same folder" : colmap->folder,
                    colmap->photos));
  }
  if (is_nerfies) {
    result->layout = CaptureLayout::kNerfies;
    result->scene = ReadNerfies(scene_folder, &result->warnings, &result->cameras);
    result->photos_found = static_cast<int>(result->scene.views.size());
    return true;
  }
  if (!transforms.empty()) {
    result->layout = CaptureLayout::kTransforms;
    result->scene =
        ReadTransformsJson(transforms, scene_folder, &result->warnings, &result->cameras);
    AddUnposedPhotos(scene_folder, result);
    return true;
  }
  std::optional<Scene> of_photos = ReadPosesOfPhotos(scene_folder, &result->warnings);
  if (!of_photos) return false;
  result->layout = CaptureLayout::kPosesBounds;
  result->scene = std::move(*of_photos);
  result->photos_found = static_cast<int>(result->scene.views.size());
  return true;
}

void WarnOfUnreadTimes(const fs::path& scene_folder, ImportResult* result) {
  if (!IsFile(scene_folder / kTimesFile)) return;
  result->warnings.push_back(
      fmt::format("{} is not read: it goes with a COLMAP model{}",
                  kTimesFile,
                  result->layout == CaptureLayout::kPhotos
                      ? "; give one, or colour the frames of one moving camera with --film --poses"
                      : "; transforms.json and metadata.json have times of their own"));
}

// Dynamic scenes: holds out the views of all cameras at every eighth time from the fifth on, so
// that each has times before and after it.
void HoldOutMoments(Scene* scene, std::vector<std::string>* warnings) {
  std::set<double> times;
  for (const View& view : scene->views) times.insert(view.time_s());
  if (times.size() < kHoldOutEvery) {
    warnings->push_back(fmt::format(
        "no view is held out for evaluation: the scene has only {} time steps", times.size()));
    return;
  }
  for (View& view : scene->views) {
    const auto step = std::distance(times.begin(), times.find(view.time_s()));
    view.held_out = step % kHoldOutEvery == kHoldOutEvery / 2;
  }
}

void HoldOutCamera(const std::string& camera, ImportResult* result) {
  const auto found = std::ranges::find(result->cameras, camera);
  if (result->cameras.size() < 2) {
    throw InvalidArgument(
        "hold_out_camera is '{}', but the scene is not one of several cameras with "
        "times; leave it out",
        camera);
  }
  if (found == result->cameras.end()) {
    throw InvalidArgument("hold_out_camera: there is no camera '{}'; the scene has {}",
                          camera,
                          SummarizeNames(result->cameras, 8));
  }
  const int shot = static_cast<int>(found - result->cameras.begin());
  for (View& view : result->scene.views) view.held_out |= view.moment && view.moment->shot == shot;
}

// Throws if the scene has times but all its frames are from one place.
void RequireSeveralPositions(const Scene& scene) {
  if (scene.capture().is_reconstructed || scene.are_pictures) return;
  throw InvalidArgument(
      "all frames are of one static camera: nothing can be reconstructed from them. "
      "Colour them as a film: leave the poses out and give --film, with --poses as a relief "
      "(2.5D)");
}

}  // namespace

void HoldOutEveryEighth(Scene* scene, std::vector<std::string>* warnings) {
  if (scene->capture().is_dynamic) return HoldOutMoments(scene, warnings);
  std::vector<View>& views = scene->views;
  const size_t held_out = (views.size() + kHoldOutEvery - 1) / kHoldOutEvery;
  if (views.size() < held_out + kMinTrainingViews) {
    warnings->push_back(
        fmt::format("no view is held out for evaluation: the scene has only {}", views.size()));
    return;
  }
  for (size_t i = 0; i < views.size(); i += kHoldOutEvery) views[i].held_out = true;
}

ImportResult ImportScene(const fs::path& scene_folder,
                         const fs::path& scratch_folder,
                         const ImportOptions& options,
                         const RunControl& run) {
  options.Validate();
  run.cancel.ThrowIfCancelled();
  if (!IsFolder(scene_folder)) {
    throw Error(ErrorCode::kNotFound, "{} is not a folder", scene_folder.string());
  }
  ImportResult result;
  if (ImportPoses(scene_folder, &result)) {
    RequireMemory(options, result.scene);
    FindViewMasks(scene_folder, run.cancel, &result.scene.views, &result.warnings);
  } else {
    ImportPhotos(scene_folder, scratch_folder, options, run, &result);
  }
  if (result.layout != CaptureLayout::kColmap) WarnOfUnreadTimes(scene_folder, &result);
  FinishPosedScene(options, &result);
  for (std::string& note : CollectPictureNotes(scene_folder, result.scene.views, run.cancel)) {
    result.warnings.push_back(std::move(note));
  }
  return result;
}

ImportResult PlaceSequence(const std::vector<SequenceFrame>& frames,
                           const fs::path& scratch_folder,
                           const ImportOptions& options,
                           const RunControl& run) {
  options.Validate();
  std::vector<Photo> photos;
  for (const SequenceFrame& frame : frames) {
    run.cancel.ThrowIfCancelled();
    Photo photo;
    photo.name = frame.name;
    photo.file = frame.file.string();
    photo.mask_file = frame.mask_file.string();
    photo.camera = frame.camera;
    ProbePhoto({}, &photo);
    photos.push_back(std::move(photo));
  }
  ImportResult result;
  result.photos_found = static_cast<int>(photos.size());
  SfmResult sfm =
      RunStructureFromMotion(photos, {}, scratch_folder, options, run, PhotoOrder::kSequence);
  result.scene = std::move(sfm.scene);
  result.sfm = std::move(sfm.report);
  result.ran_structure_from_motion = true;
  return result;
}

void FinishPosedScene(const ImportOptions& options, ImportResult* result) {
  Scene& scene = result->scene;
  if (scene.views.size() < kMinTrainingViews) {
    throw InvalidArgument("the scene has only {} posed view; at least 2 are needed",
                          scene.views.size());
  }
  RequireSeveralPositions(scene);
  result->photos_registered = scene.are_pictures ? 0 : static_cast<int>(scene.views.size());
  result->masked_views = static_cast<int>(
      std::ranges::count_if(scene.views, [](const View& v) { return !v.mask_file.empty(); }));
  result->undistorted =
      std::ranges::any_of(scene.views, [](const View& v) { return !IsUndistorted(v.distortion); });
  if (!scene.are_pictures) {
    DropWeakPoints(&scene);
    Normalise(result);
    AddRandomPointsWhenEmpty(result);
  }
  if (options.hold_out_every_eighth) HoldOutEveryEighth(&scene, &result->warnings);
  if (!options.hold_out_camera.empty()) HoldOutCamera(options.hold_out_camera, result);
  if (options.hold_out_block > 0.0) HoldOutBlock(options.hold_out_block, &scene);
  if (scene.TrainingViews().size() < kMinTrainingViews) {
    throw InvalidArgument("only {} view is left for training when the others are held out",
                          scene.TrainingViews().size());
  }
}

}  // namespace color3d
