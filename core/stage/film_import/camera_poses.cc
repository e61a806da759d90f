#include "core/stage/film_import/camera_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/median.h"
#include "core/film/moving_regions.h"
#include "core/scene/view_images.h"
#include "core/stage/film_import/film_frames.h"
#include "core/stage/film_import/film_poses.h"
#include "core/stage/film_import/moving_region_files.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Pictures of one camera for structure-from-motion.
struct SfmInput {
  ShotMotion motion;
  std::vector<SequenceFrame> pictures;
  std::vector<std::vector<int>> views;  // views that get the pose of each picture
};

// Median L of each pixel over up to 9 evenly spread frames, which removes moving objects.
Image MedianPicture(const ViewImages& images, const std::vector<int>& views) {
  constexpr size_t kFrames = 9;
  std::vector<std::shared_ptr<const Image>> frames;
  const size_t count = std::min(kFrames, views.size());
  for (size_t i = 0; i < count; ++i) {
    frames.push_back(images.Luminance(views[(2 * i + 1) * views.size() / (2 * count)]));
  }
  Image median = *frames[0];
  std::vector<float> values(count);
  for (size_t p = 0; p < median.data.size(); ++p) {
    for (size_t i = 0; i < count; ++i) values[i] = frames[i]->data[p];
    std::ranges::nth_element(values, values.begin() + count / 2);
    median.data[p] = values[count / 2];
  }
  return median;
}

class SfmInputs {
 public:
  SfmInputs(const fs::path& frames_root, const Scene& frames, StageContext& context)
      : frames_root_(frames_root),
        frames_(frames),
        context_(context),
        files_(frames, context.scratch_folder() / "regions") {}

  const MovingRegionFiles& files() const { return files_; }

  SfmInput Of(const FramesOfCamera& camera, int number) const {
    SfmInput seen;
    seen.motion = WriteMovingRegions(frames_root_, frames_, camera.views, files_, context_);
    if (seen.motion.camera_stands_still) {
      seen.pictures.push_back(Standing(camera, number));
      seen.views.push_back(camera.views);
      return seen;
    }
    for (const int view : camera.views) {
      seen.pictures.push_back({frames_.views[view].name,
                               frames_root_ / frames_.views[view].image_file,
                               files_.StillFile(view),
                               number});
      seen.views.push_back({view});
    }
    return seen;
  }

 private:
  SequenceFrame Standing(const FramesOfCamera& camera, int number) const {
    const ViewImages images(frames_, frames_root_, /*max_side_px=*/0, 0);
    const fs::path folder = context_.scratch_folder() / "standing";
    fs::create_directories(folder);
    const fs::path file = folder / fmt::format("{:03}.png", number);
    WriteFileAtomic(file, EncodeGrayFrame(MedianPicture(images, camera.views)));
    // An absolute path differs from the names of all views.
    return {fs::absolute(file).string(), file, {}, number};
  }

  const fs::path& frames_root_;
  const Scene& frames_;
  StageContext& context_;
  MovingRegionFiles files_;
};

// Share of the pictures with a pose, by camera.
std::vector<double> SharesPlaced(const Scene& placed, const std::vector<SfmInput>& seen) {
  std::set<std::string> names;
  for (const View& view : placed.views) names.insert(view.name);
  std::vector<double> shares;
  for (const SfmInput& camera : seen) {
    int found = 0;
    for (const SequenceFrame& picture : camera.pictures) found += names.contains(picture.name);
    shares.push_back(found / static_cast<double>(camera.pictures.size()));
  }
  return shares;
}

// Warns of cameras with too few poses. Throws if fewer than two cameras remain.
void RequireTwoCameras(const std::vector<FramesOfCamera>& cameras,
                       const std::vector<SfmInput>& seen,
                       const std::vector<double>& shares,
                       StageContext& context) {
  std::string kept, dropped;
  size_t kept_count = 0;
  for (size_t i = 0; i < cameras.size(); ++i) {
    std::string& list = shares[i] >= kLeastShareWithPoses ? kept : dropped;
    kept_count += shares[i] >= kLeastShareWithPoses;
    list += (list.empty() ? "" : ", ") + cameras[i].film;
    if (shares[i] >= kLeastShareWithPoses) continue;
    list += seen[i].motion.camera_stands_still ? " (stands still)"
                                               : fmt::format(" ({:.0f} %)", 100.0 * shares[i]);
  }
  if (kept_count < 2) {
    throw InvalidArgument(
        "the poses of the cameras could not be estimated together: {} (share of frames with a pose "
        "relative to {}). Cameras must share much of the static background and stand close enough. "
        "Give the poses (transforms.json), or colour each film on its own",
        dropped,
        kept.empty() ? "the others" : kept);
  }
  if (dropped.empty()) return;
  context.Warn(
      "left out, because too few of their frames have a pose relative to {}: {}", kept, dropped);
}

// The frames of the remaining cameras with their poses, and the points that they observe.
Scene PlacedScene(const Scene& placed,
                  const Scene& frames,
                  const std::vector<SfmInput>& seen,
                  const std::vector<double>& shares) {
  std::map<std::string, int> index;  // of a placed picture
  for (size_t i = 0; i < placed.views.size(); ++i)
    index[placed.views[i].name] = static_cast<int>(i);
  std::vector<std::pair<View, int>> views;  // with the picture that has its pose
  for (size_t c = 0; c < seen.size(); ++c) {
    if (shares[c] < kLeastShareWithPoses) continue;
    for (size_t p = 0; p < seen[c].pictures.size(); ++p) {
      const auto found = index.find(seen[c].pictures[p].name);
      if (found == index.end()) continue;
      for (const int i : seen[c].views[p]) {
        View view = placed.views[found->second];
        const View& frame = frames.views[i];
        view.name = frame.name;
        view.image_file = frame.image_file;
        view.mask_file = frame.mask_file;
        view.moment = frame.moment;
        views.emplace_back(std::move(view), found->second);
      }
    }
  }
  std::ranges::sort(
      views, {}, [](const auto& view) -> const std::string& { return view.first.name; });
  Scene scene;
  std::map<int, std::vector<int>> views_of;  // by picture
  for (auto& [view, picture] : views) {
    views_of[picture].push_back(static_cast<int>(scene.views.size()));
    scene.views.push_back(std::move(view));
  }
  for (const SparsePoint& point : placed.points) {
    SparsePoint kept = point;
    kept.views.clear();
    int pictures = 0;
    for (const int picture : point.views) {
      const auto found = views_of.find(picture);
      if (found == views_of.end()) continue;
      ++pictures;
      kept.views.insert(kept.views.end(), found->second.begin(), found->second.end());
    }
    if (pictures < 2) continue;
    std::ranges::sort(kept.views);
    scene.points.push_back(std::move(kept));
  }
  return scene;
}

FilmFindings FindingsOf(const std::vector<FramesOfCamera>& cameras,
                        const std::vector<SfmInput>& seen,
                        int placed) {
  FilmFindings findings{.poses_found = true, .frames_placed = placed, .camera_stands_still = true};
  double moving = 0.0, frames = 0.0;
  std::vector<double> background;
  for (size_t i = 0; i < seen.size(); ++i) {
    const ShotMotion& motion = seen[i].motion;
    const auto count = static_cast<double>(cameras[i].views.size());
    moving += count * motion.moving_share;
    frames += count;
    findings.camera_stands_still &= motion.camera_stands_still;
    background.push_back(motion.background_px);
  }
  findings.motion_energy = moving / frames;
  findings.background_px = Median(std::move(background));
  return findings;
}

}  // namespace

PlacedCameras PlaceCameras(const fs::path& frames_root,
                           const Scene& frames,
                           const std::vector<FramesOfCamera>& cameras,
                           const ImportOptions& options,
                           StageContext& context) {
  const SfmInputs inputs(frames_root, frames, context);
  std::vector<SfmInput> seen;
  std::vector<SequenceFrame> pictures;
  for (size_t i = 0; i < cameras.size(); ++i) {
    seen.push_back(inputs.Of(cameras[i], static_cast<int>(i) + 1));
    pictures.insert(pictures.end(), seen[i].pictures.begin(), seen[i].pictures.end());
  }
  PlacedCameras placed;
  placed.result =
      PlaceSequence(pictures, context.scratch_folder() / "poses", options, context.control());
  const std::vector<double> shares = SharesPlaced(placed.result.scene, seen);
  RequireTwoCameras(cameras, seen, shares, context);
  placed.result.scene = PlacedScene(placed.result.scene, frames, seen, shares);
  const Scene& scene = placed.result.scene;
  placed.findings = FindingsOf(cameras, seen, static_cast<int>(scene.views.size()));
  std::vector<int> of_cameras;
  for (size_t i = 0; i < cameras.size(); ++i) {
    if (shares[i] < kLeastShareWithPoses) continue;
    of_cameras.insert(of_cameras.end(), cameras[i].views.begin(), cameras[i].views.end());
  }
  WarnOfUnplacedFrames(frames, of_cameras, scene, context);
  inputs.files().Publish(scene, context);
  return placed;
}

}  // namespace color3d
