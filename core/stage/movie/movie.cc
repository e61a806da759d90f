#include "core/stage/movie/movie.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/files.h"
#include "core/base/median.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/formats/camera_file.h"
#include "core/splat/raster/render.h"
#include "core/stage/formats/artifacts.h"
#include "core/stage/sources/focus.h"
#include "core/video/mp4_writer.h"
#include "core/view/path/camera_path.h"

namespace color3d {
namespace {

constexpr int kFocusSidePx = 256;              // of the picture that tells how far the scene is
constexpr int64_t kMaxFileBytes = 64ll << 20;  // of cameras
constexpr int kLeastSidePx = 16;

// The one whose picture says how the movie's looks and how far away things are.
int HomeView(const Scene& scene, const StageContext& context) {
  if (scene.views.empty()) throw InvalidArgument("the scene has no views");
  if (context.HasInput(artifact::kKeyView)) return ReadKeyView(context, scene);
  return ViewsInOrder(scene)[scene.views.size() / 2];
}

std::vector<PathCamera> CamerasOfFile(const RenderOptions& options,
                                      const Scene& scene,
                                      const Camera& home) {
  const std::string text = ReadFile(options.cameras, kMaxFileBytes);
  std::vector<PathCamera> cameras;
  for (const FileCamera& camera :
       ReadCameraFile(text, "the file of cameras", scene, home, kMaxMovieFrames)) {
    cameras.push_back({camera.camera, camera.cam_from_world});
  }
  return cameras;
}

std::vector<PathCamera> CamerasOfViews(const RenderOptions& options, const Scene& scene, int home) {
  std::vector<int> order;
  for (const std::string& name : options.views) order.push_back(scene.FindView(name));
  if (order.empty()) order = scene.IsDynamic() ? scene.FramesOfShotOf(home) : ViewsInOrder(scene);
  std::vector<PathCamera> cameras;
  for (const int index : order) {
    const View& view = scene.views[index];
    cameras.push_back({view.camera, view.cam_from_world, view.time_s()});
  }
  return cameras;
}

// Where that view's camera stood, at all moments.
std::vector<PathCamera> StillCamera(const Scene& scene, int home) {
  std::vector<PathCamera> cameras;
  for (const double time_s : scene.Times()) {
    cameras.push_back({scene.views[home].camera, scene.views[home].cam_from_world, time_s});
  }
  return cameras;
}

// The moment that each frame shows, where the frames are not those of the film: all of the scene's
// time, and back where the path comes back.
void SetTimes(const RenderOptions& options, const Scene& scene, std::vector<PathCamera>* frames) {
  const std::vector<double> times = scene.Times();
  const double last = std::max<double>(1.0, static_cast<double>(frames->size()) - 1.0);
  for (size_t i = 0; i < frames->size(); ++i) {
    double share = static_cast<double>(i) / last;
    if (options.bounce) share = 1.0 - std::abs(2.0 * share - 1.0);
    (*frames)[i].time_s = times.front() + share * (times.back() - times.front());
  }
}

// Whether a movie without a wanted length shows every camera of its path once.
bool IsOneByOne(const RenderOptions& options, const Scene& scene) {
  using Path = RenderOptions::Path;
  return options.path == Path::kCameras || options.path == Path::kStill ||
         (options.path == Path::kPhotos && scene.IsDynamic());
}

// Every camera as it is, and back again where the movie is to end as it begins.
std::vector<PathCamera> OneByOne(std::vector<PathCamera> cameras, bool bounce) {
  const size_t count = cameras.size();
  for (size_t i = count - 1; bounce && i-- > 1;) cameras.push_back(cameras[i]);
  return cameras;
}

// The frames' cameras, all of one size, with their times where they have their own.
std::vector<PathCamera> CamerasOf(const RenderOptions& options,
                                  const Scene& scene,
                                  const GaussianModel& model,
                                  StageContext& context) {
  using Path = RenderOptions::Path;
  const int home = HomeView(scene, context);
  const View& view = scene.views[home];
  const Camera small = view.camera.FitWithin(kFocusSidePx);
  const Eigen::Vector3d focus =
      FocusOf(view,
              small,
              RenderView(model, small, view.cam_from_world, context.pool(), 0.0f, view.time_s())
                  .median_depth);
  std::vector<PathCamera> stations;
  if (options.path == Path::kCameras) stations = CamerasOfFile(options, scene, view.camera);
  if (options.path == Path::kPhotos) stations = CamerasOfViews(options, scene, home);
  if (options.path == Path::kStill) stations = StillCamera(scene, home);

  Camera picture = options.path == Path::kCameras ? stations[0].camera : view.camera;
  picture = picture.FitWithin(options.max_side_px);
  picture.width -= picture.width % 2;  // as movies need it
  picture.height -= picture.height % 2;
  if (std::min(picture.width, picture.height) < kLeastSidePx) {
    throw InvalidArgument(
        "frames of {} x {} px are too small; their shorter side must be at least "
        "{} px: ask for a larger max_side_px or for cameras of another shape",
        picture.width,
        picture.height,
        kLeastSidePx);
  }
  for (PathCamera& station : stations) {
    station.camera = CoverPicture(station.camera, picture.width, picture.height);
  }
  if (!options.frames && IsOneByOne(options, scene)) return OneByOne(stations, options.bounce);

  const bool turns = options.path == Path::kOrbit;
  const std::vector<double> shares =
      FrameShares(options.frames.value_or(kDefaultMovieFrames), options.bounce, turns);
  if (turns) {
    std::vector<PathCamera> frames = TurnFrames(scene, home, focus, shares);
    for (PathCamera& frame : frames) {
      frame.camera = CoverPicture(frame.camera, picture.width, picture.height);
    }
    return frames;
  }
  const SmoothPath path(stations, (focus - view.cam_from_world.Center()).norm());
  std::vector<PathCamera> frames;
  for (const double share : shares) frames.push_back(path.At(share));
  return frames;
}

std::vector<PathCamera> FramesOf(const RenderOptions& options,
                                 const Scene& scene,
                                 const GaussianModel& model,
                                 StageContext& context) {
  std::vector<PathCamera> frames = CamerasOf(options, scene, model, context);
  const bool own_times = !options.frames && options.path != RenderOptions::Path::kCameras &&
                         IsOneByOne(options, scene);
  if (!own_times && scene.IsDynamic()) SetTimes(options, scene, &frames);
  for (PathCamera& frame : frames) frame.time_s = options.time_s.value_or(frame.time_s);
  return frames;
}

// Frames of the scene's own moments go at its own rate.
double RateOf(const RenderOptions& options,
              const Scene& scene,
              const std::vector<PathCamera>& frames) {
  const bool own = !options.frames && !options.time_s && frames.size() > 1 && scene.IsDynamic() &&
                   options.path != RenderOptions::Path::kCameras && IsOneByOne(options, scene);
  if (!own) return options.frames_per_second;
  std::vector<double> steps;
  for (size_t i = 1; i < frames.size(); ++i) {
    steps.push_back(std::abs(frames[i].time_s - frames[i - 1].time_s));
  }
  const double step = Median(std::move(steps));  // some frames may have found no place
  // Times may also count from 0 to 1 for the whole.
  const bool seconds = frames.size() > 2 && scene.Times().back() > 1.0;
  return seconds && step > 0.0 ? std::clamp(1.0 / step, 1.0, 120.0) : options.frames_per_second;
}

}  // namespace

void RenderMovie(const RenderOptions& options,
                 const Scene& scene,
                 const GaussianModel& model,
                 StageContext& context) {
  if (!scene.IsDynamic() && (options.path == RenderOptions::Path::kStill || options.time_s)) {
    throw InvalidArgument(
        "this scene has no times: a camera that stands still, or a moment, is of use for a scene "
        "that moves");
  }
  const std::vector<PathCamera> frames = FramesOf(options, scene, model, context);
  if (options.pictures && frames.size() > kMaxMoviePictures) {
    throw InvalidArgument(
        "{} frames are too many to keep as pictures; at most {} are: ask for "
        "fewer frames or only for the video",
        frames.size(),
        kMaxMoviePictures);
  }
  const std::filesystem::path file = context.scratch_folder() / artifact::kMovie;
  std::optional<Mp4Writer> movie;
  if (options.video) {
    movie.emplace(file,
                  Mp4Options{.width = frames[0].camera.width,
                             .height = frames[0].camera.height,
                             .frames_per_second = RateOf(options, scene, frames),
                             .threads = context.pool().thread_count()});
    if (movie->encoder() == "mpeg4") {
      context.progress().OnWarning(
          "this machine's libavcodec has no H.264 encoder (libx264): the movie is MPEG-4 part 2, "
          "which browsers do not show");
    }
  }
  const int64_t count = static_cast<int64_t>(frames.size());
  for (int64_t i = 0; i < count; ++i) {
    context.cancel().ThrowIfCancelled();
    const PathCamera& frame = frames[i];
    const Image srgb = SrgbFromLab(
        RenderView(model, frame.camera, frame.cam_from_world, context.pool(), 0.0f, frame.time_s)
            .lab);
    if (movie) movie->Add(srgb, context.pool());
    if (options.pictures) {
      context.WriteOutput(fmt::format("{}{:05}.png", artifact::kFrames, i + 1), EncodePng8(srgb));
    }
    context.progress().OnProgress(i + 1, count, "rendering frames");
  }
  if (!movie) return;
  movie->Finish();
  context.TakeOutput(artifact::kMovie, file);
}

}  // namespace color3d
