#include "core/scene/sfm.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/scene/colmap_model.h"
#include "core/scene/colmap_process.h"
#include "core/scene/lens.h"
#include "core/scene/sfm_photos.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Few photos match each with each; long sequences match neighbours first.
constexpr size_t kExhaustiveLimit = 60;
constexpr int kSequentialOverlap = 15;
constexpr int kMatchingBlock = 10;
constexpr size_t kMinPlaced = 3;

// Where one run keeps its files.
struct Workspace {
  fs::path folder;
  fs::path images() const { return folder / "photos"; }
  fs::path database() const { return folder / "database.db"; }
};

void ExtractFeatures(ColmapProcess& colmap,
                     const Workspace& work,
                     const ImportOptions& options,
                     size_t count) {
  colmap.RunOrThrow({"feature_extractor",
                     "--database_path",
                     work.database().string(),
                     "--image_path",
                     work.images().string(),
                     "--ImageReader.camera_model",
                     "SIMPLE_RADIAL",
                     "--ImageReader.single_camera_per_folder",
                     "1",
                     "--SiftExtraction.use_gpu",
                     "0",
                     "--SiftExtraction.num_threads",
                     colmap.Threads(),
                     "--SiftExtraction.max_image_size",
                     std::to_string(options.sfm_max_image_side_px),
                     "--SiftExtraction.max_num_features",
                     std::to_string(options.sfm_max_features)},
                    {"finding features in photos", "Processed file", static_cast<int64_t>(count)});
}

void Match(ColmapProcess& colmap, const Workspace& work, size_t count, bool exhaustive) {
  std::vector<std::string> arguments = {exhaustive ? "exhaustive_matcher" : "sequential_matcher",
                                        "--database_path",
                                        work.database().string(),
                                        "--SiftMatching.use_gpu",
                                        "0",
                                        "--SiftMatching.num_threads",
                                        colmap.Threads()};
  ColmapPhase phase{"matching photos", "Matching image", static_cast<int64_t>(count)};
  if (exhaustive) {
    const int64_t blocks = static_cast<int64_t>(count + kMatchingBlock - 1) / kMatchingBlock;
    arguments.insert(arguments.end(),
                     {"--ExhaustiveMatching.block_size", std::to_string(kMatchingBlock)});
    phase = {"matching blocks of photos", "Matching block", blocks * blocks};
  } else {
    arguments.insert(arguments.end(),
                     {"--SequentialMatching.overlap", std::to_string(kSequentialOverlap)});
  }
  colmap.RunOrThrow(std::move(arguments), phase);
}

// How much the mapper insists on. Straight: a smaller angle between the first two photos, and no
// lens distortion until all cameras stand, because on walks straight ahead distortion and motion
// explain each other and the mapper gives up with an absurd lens. Loose: fewer common points, too,
// which may join what does not belong together.
enum class Strictness { kDefault, kStraight, kLoose };

std::vector<std::string> MapperThresholds(Strictness strictness) {
  if (strictness == Strictness::kDefault) return {};
  std::vector<std::string> arguments = {
      "--Mapper.init_min_tri_angle", "4", "--Mapper.ba_refine_extra_params", "0"};
  if (strictness == Strictness::kLoose) {
    arguments.insert(arguments.end(),
                     {"--Mapper.init_min_num_inliers",
                      "50",
                      "--Mapper.min_num_matches",
                      "10",
                      "--Mapper.abs_pose_min_num_inliers",
                      "15",
                      "--Mapper.abs_pose_min_inlier_ratio",
                      "0.15"});
  }
  return arguments;
}

// False for models that only look like one: a handful of points, or a lens that no one builds.
bool IsPlausible(const ColmapModel& model) {
  constexpr size_t kPointsPerPhoto = 10;
  if (model.points.size() < kPointsPerPhoto * model.images.size()) return false;
  for (const auto& [id, image] : model.images) {
    const ColmapCamera& camera = model.cameras.at(image.camera_id);
    const double focal = camera.camera.fx / std::max(camera.camera.width, camera.camera.height);
    if (!(focal > 0.2 && focal < 8.0 && std::abs(camera.distortion.k[0]) < 1.0)) return false;
    try {
      UndistortedCamera(camera.camera, camera.distortion);
    } catch (const Error&) {
      return false;
    }
  }
  return true;
}

// The plausible model with the most photos below `folder`; nullopt when there is none.
std::optional<ColmapModel> BestModel(const fs::path& folder, fs::path* where) {
  std::optional<ColmapModel> best;
  std::set<fs::path> candidates;
  for (const auto& entry : fs::directory_iterator(folder)) candidates.insert(entry.path());
  for (const fs::path& candidate : candidates) {
    if (!IsColmapFolder(candidate)) continue;
    ColmapModel model = LoadColmapModel(candidate);
    if (!IsPlausible(model) || (best && model.images.size() <= best->images.size())) continue;
    best = std::move(model);
    *where = candidate;
  }
  return best;
}

std::optional<ColmapModel> Map(ColmapProcess& colmap,
                               const Workspace& work,
                               size_t count,
                               const std::string& attempt,
                               Strictness strictness) {
  const fs::path output = work.folder / ("models_" + attempt);
  fs::create_directories(output);
  std::vector<std::string> arguments = {"mapper",
                                        "--database_path",
                                        work.database().string(),
                                        "--image_path",
                                        work.images().string(),
                                        "--output_path",
                                        output.string(),
                                        "--Mapper.num_threads",
                                        colmap.Threads(),
                                        "--Mapper.min_model_size",
                                        std::to_string(kMinPlaced),
                                        "--Mapper.ba_global_function_tolerance",
                                        "1e-6",
                                        "--Mapper.extract_colors",
                                        "0"};
  const std::vector<std::string> thresholds = MapperThresholds(strictness);
  arguments.insert(arguments.end(), thresholds.begin(), thresholds.end());
  const ColmapPhase phase{"placing cameras (" + attempt + " attempt)",
                          "Registering image",
                          static_cast<int64_t>(count)};
  colmap.Run(std::move(arguments), phase);  // another exit code than 0 says: no model
  fs::path where;
  std::optional<ColmapModel> best = BestModel(output, &where);
  if (!best || strictness == Strictness::kDefault) return best;
  // Now that the cameras stand, the lens may bend.
  const fs::path refined = work.folder / ("models_" + attempt + "_refined") / "0";
  fs::create_directories(refined);
  const int code = colmap.Run(
      {"bundle_adjuster", "--input_path", where.string(), "--output_path", refined.string()},
      {"refining cameras", "Bundle adjustment report", 1});
  std::optional<ColmapModel> better;
  if (code == 0) better = BestModel(refined.parent_path(), &where);
  return better ? std::move(better) : std::move(best);
}

ColmapModel Solve(ColmapProcess& colmap,
                  const Workspace& work,
                  size_t count,
                  ProgressObserver& progress) {
  std::optional<ColmapModel> best;
  const auto enough = [&] {
    return best && 2 * best->images.size() >= count && best->images.size() >= kMinPlaced;
  };
  const auto attempt = [&](const char* name, Strictness strictness) {
    std::optional<ColmapModel> model = Map(colmap, work, count, name, strictness);
    if (!model || (best && model->images.size() <= best->images.size())) return;
    best = std::move(model);
    if (strictness == Strictness::kLoose) {
      progress.OnWarning("camera positions were found with loose thresholds only; check them");
    }
  };
  const bool exhaustive_first = count <= kExhaustiveLimit;
  Match(colmap, work, count, exhaustive_first);
  attempt("first", Strictness::kDefault);
  if (!enough() && !exhaustive_first) {
    progress.OnWarning("neighbouring photos alone do not hang together; comparing all pairs");
    Match(colmap, work, count, true);
    attempt("exhaustive", Strictness::kDefault);
  }
  if (!enough()) attempt("straight", Strictness::kStraight);
  if (!enough()) attempt("loose", Strictness::kLoose);
  return best ? std::move(*best) : ColmapModel{};
}

void RequirePlaced(size_t placed, size_t count, const fs::path& log) {
  if (placed >= kMinPlaced) return;
  throw InvalidArgument(
      (placed == 0 ? "none" : "only " + std::to_string(placed)) + " of " + std::to_string(count) +
      " photos could be placed: the others share too few features with them; take at least 3 sharp "
      "photos from different places that overlap by 60 %; log: " +
      log.filename().string());
}

// From COLMAP's cameras for the copies to cameras for the photos, and from its numbers to views.
SfmResult SceneOfModel(const ColmapModel& model,
                       const std::vector<Photo>& photos,
                       const std::vector<std::string>& copies) {
  std::map<std::string, uint32_t> image_of_copy;
  for (const auto& [id, image] : model.images) image_of_copy[image.name] = id;
  SfmResult result;
  std::map<uint32_t, int> view_of_image;
  for (size_t i = 0; i < photos.size(); ++i) {
    const auto it = image_of_copy.find(copies[i]);
    if (it == image_of_copy.end()) {
      result.unplaced.push_back(photos[i].name);
      continue;
    }
    const ColmapImage& image = model.images.at(it->second);
    const ColmapCamera& camera = model.cameras.at(image.camera_id);
    View view;
    view.name = photos[i].name;
    view.image_file = photos[i].file;
    // The copies are turned upright already, so no more turning.
    view.captured_camera = camera.camera.Scaled(photos[i].width, photos[i].height);
    view.distortion = camera.distortion;
    view.camera = UndistortedCamera(view.captured_camera, view.distortion);
    view.cam_from_world = image.cam_from_world;
    view_of_image[it->second] = static_cast<int>(result.scene.views.size());
    result.scene.views.push_back(std::move(view));
  }
  for (const ColmapPoint& from : model.points) {
    SparsePoint point;
    point.position = from.position;
    point.reprojection_error_px = from.error_px;
    std::set<int> views;
    for (uint32_t id : from.image_ids) {
      const auto it = view_of_image.find(id);
      if (it != view_of_image.end()) views.insert(it->second);
    }
    point.views.assign(views.begin(), views.end());
    result.scene.points.push_back(std::move(point));
  }
  return result;
}

}  // namespace

SfmResult RunStructureFromMotion(const std::vector<Photo>& photos,
                                 const fs::path& scene_folder,
                                 const fs::path& scratch_folder,
                                 const ImportOptions& options,
                                 ProgressObserver& progress,
                                 const CancellationToken& cancel) {
  std::error_code error;
  fs::create_directories(scratch_folder, error);
  // What an earlier, interrupted run left would be mixed with ours.
  fs::remove_all(scratch_folder / "photos", error);
  fs::remove_all(scratch_folder / "database.db", error);
  for (const std::string attempt : {"first", "exhaustive", "straight", "loose"}) {
    fs::remove_all(scratch_folder / ("models_" + attempt), error);
    fs::remove_all(scratch_folder / ("models_" + attempt + "_refined"), error);
  }
  const Workspace work{scratch_folder};
  ColmapProcess colmap(scratch_folder / "sfm.log", options, progress, cancel);
  const std::vector<std::string> copies = WriteFeatureImages(
      photos, scene_folder, work.images(), options.sfm_max_image_side_px, progress, cancel);
  ExtractFeatures(colmap, work, options, photos.size());
  const ColmapModel model = Solve(colmap, work, photos.size(), progress);
  RequirePlaced(model.images.size(), photos.size(), colmap.log());
  return SceneOfModel(model, photos, copies);
}

}  // namespace color3d
