#include "core/stage/film_import/film_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/median.h"
#include "core/film/moving_regions.h"
#include "core/image/codec.h"
#include "core/scene/relief.h"
#include "core/stage/film_import/film_frames.h"
#include "core/stage/film_import/moving_region_files.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

bool AreEnough(size_t some, size_t all) {
  return static_cast<double>(some) >= kLeastShareWithPoses * static_cast<double>(all);
}

// Frames of the longest shot.
std::vector<int> LongestShot(const Scene& scene) {
  std::map<int, std::vector<int>> shots;
  for (size_t i = 0; i < scene.views.size(); ++i) {
    shots[scene.views[i].moment->shot].push_back(static_cast<int>(i));
  }
  return std::ranges::max_element(shots, {}, [](const auto& shot) { return shot.second.size(); })
      ->second;
}

// Throws what PlaceSequence and FinishPosedScene throw.
ImportResult Place(const fs::path& frames_root,
                   const Scene& scene,
                   const std::vector<int>& shot,
                   const MovingRegionFiles& files,
                   ImportOptions options,
                   StageContext& context) {
  options.hold_out_every_eighth = false;  // the caller does that
  options.hold_out_block = 0.0;
  std::vector<SequenceFrame> frames;
  for (const int view : shot) {
    frames.push_back({scene.views[view].name,
                      frames_root / scene.views[view].image_file,
                      files.StillFile(view)});
  }
  ImportResult result =
      PlaceSequence(frames, context.scratch_folder() / "poses", options, context.control());
  FinishPosedScene(options, &result);
  return result;
}

// The placed frames with the files and times of the film.
Scene DynamicScene(Scene placed, const Scene& film) {
  for (View& view : placed.views) {
    const View& frame = film.views[film.FindView(view.name)];
    view.image_file = frame.image_file;
    view.mask_file = frame.mask_file;
    view.moment = frame.moment;
  }
  return placed;
}

// The frames of the shot, taken by one standing camera.
Scene ReliefScene(const Scene& film, const std::vector<int>& shot, const MovingRegionFiles& files) {
  constexpr int kPoints = 20'000;
  Scene scene;
  std::vector<double> feet;
  for (const int frame : shot) {
    scene.views.push_back(film.views[frame]);
    const std::string file = files.MovingFile(frame).string();
    const double foot = LowestMovingRow(DecodeImage(ReadFile(file), file));
    if (foot >= 0.0) feet.push_back(foot);
  }
  scene.relief = FitRelief(std::move(feet));
  const int last = static_cast<int>(scene.views.size()) - 1;
  const Camera& camera = scene.views[0].camera;
  for (const Eigen::Vector3d& position : ReliefPoints(*scene.relief, camera, kPoints)) {
    scene.points.push_back({position, -1.0, {0, last}});
  }
  return scene;
}

// Median change of the camera's step from frame to frame, relative to the median step. Near 0 for a
// carried or driven camera.
double Unevenness(const Scene& scene) {
  std::vector<double> steps, changes;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (size_t i = 1; i < scene.views.size(); ++i) {
    const Eigen::Vector3d step =
        scene.views[i].cam_from_world.Center() - scene.views[i - 1].cam_from_world.Center();
    steps.push_back(step.norm());
    if (i > 1) changes.push_back((step - last).norm());
    last = step;
  }
  if (changes.empty()) return 0.0;
  const double step = Median(std::move(steps));
  return step > 0.0 ? Median(std::move(changes)) / step : 0.0;
}

// Moving objects that fill most of the picture are mistaken for the background.
void WarnOfUnevenPath(double unevenness, StageContext& context) {
  constexpr double kUneven = 0.4;
  if (unevenness < kUneven) return;
  context.Warn(
      "the camera path is uneven (its steps change by {:.0f} % from frame to frame): moving "
      "objects "
      "may have been mistaken for the background; check the poses, or set film_poses to off",
      100.0 * unevenness);
}

// Returns true for errors after which the film is kept without poses.
bool IsAboutPoses(const Error& error) {
  return error.code() == ErrorCode::kInvalidArgument ||
         error.code() == ErrorCode::kDeadlineExceeded ||
         error.code() == ErrorCode::kFailedPrecondition;
}

}  // namespace

void FindFilmPoses(const fs::path& frames_root,
                   const ImportOptions& options,
                   StageContext& context,
                   Scene* scene,
                   ImportFacts* facts) {
  const auto keep_film = [&](const std::string& why) {
    context.Warn("the film stays without poses: " + why);
  };
  facts->film.emplace();
  std::vector<int> all(scene->views.size());
  std::iota(all.begin(), all.end(), 0);
  const std::vector<int> shot = LongestShot(*scene);
  if (!AreEnough(shot.size(), scene->views.size())) {
    return keep_film(fmt::format(
        "its longest shot has {} of {} frames; take one shot (film_begin_s, film_end_s)",
        shot.size(),
        scene->views.size()));
  }
  const MovingRegionFiles files(*scene, context.scratch_folder() / "regions");
  const ShotMotion motion = WriteMovingRegions(frames_root, *scene, shot, files, context);
  facts->film->motion_energy = motion.moving_share;
  facts->film->background_px = motion.background_px;
  facts->film->camera_stands_still = motion.camera_stands_still;
  if (motion.camera_stands_still) {
    context.Warn(
        "the camera stands still (the background shifts by {:.2f} px at {} px), so depth is "
        "unknown: the scene is a relief (2.5D) with assumed depth. Ground lies in front of an "
        "upright backdrop, and moving objects stand on it; view it from close to the camera only",
        motion.background_px,
        kMotionSidePx);
    Scene relief = ReliefScene(*scene, shot, files);
    facts->film->poses_found = true;
    facts->photos_registered = static_cast<int>(relief.views.size());
    WarnOfUnplacedFrames(*scene, all, relief, context);
    files.Publish(relief, context);
    *scene = std::move(relief);
    return;
  }
  const fs::path log = context.scratch_folder() / "poses" / "sfm.log";
  const auto keep_log = [&] {
    if (fs::exists(log)) context.WriteOutput(artifact::kSfmLog, ReadFile(log));
  };
  ImportResult result;
  try {
    result = Place(frames_root, *scene, shot, files, options, context);
  } catch (const Error& e) {
    if (!IsAboutPoses(e)) throw;
    keep_log();
    return keep_film(e.what());
  }
  keep_log();
  facts->ran_structure_from_motion = true;
  facts->sfm_plan = result.sfm.plan;
  facts->film->frames_placed = result.photos_registered;
  if (!AreEnough(result.scene.views.size(), scene->views.size())) {
    return keep_film(
        fmt::format("only {} of {} frames have a pose; {:.0f} % of the picture is moving objects, "
                    "and the other frames share too little static background with these",
                    result.scene.views.size(),
                    scene->views.size(),
                    100.0 * motion.moving_share));
  }
  for (const std::string& warning : result.warnings) context.Warn(warning);
  facts->film->poses_found = true;
  facts->undistorted = result.undistorted;
  facts->random_points = result.random_points;
  facts->photos_registered = result.photos_registered;
  const Scene placed = DynamicScene(std::move(result.scene), *scene);
  WarnOfUnplacedFrames(*scene, all, placed, context);
  facts->film->path_unevenness = Unevenness(placed);
  WarnOfUnevenPath(facts->film->path_unevenness, context);
  files.Publish(placed, context);
  *scene = placed;
}

}  // namespace color3d
