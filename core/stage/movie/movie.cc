#include "core/stage/movie/movie.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/formats/camera_file.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/movie/film_clock.h"
#include "core/stage/sources/focus.h"
#include "core/stage/sources/render_view.h"
#include "core/video/mp4_writer.h"
#include "core/view/path/camera_path.h"

namespace color3d {
namespace {

constexpr int kFocusSidePx = 256;  // longer side of the render that the distance is measured in
constexpr int64_t kMaxFileBytes = 64ll << 20;  // of cameras
constexpr int kLeastSidePx = 16;

// The view whose camera gives the movie its picture format and the distance of the scene.
int HomeView(const Scene& scene, const StageContext& context) {
  if (scene.views.empty()) throw InvalidArgument("the scene has no views");
  if (context.HasInput(artifact::kKeyView)) return ReadKeyView(context, scene);
  return ViewsInOrder(scene)[scene.views.size() / 2];
}

// A camera path without a number of frames.
struct Stations {
  std::vector<PathCamera> cameras;
  bool have_times = false;  // of the scene
};

// Returns a time of the scene, which ends at `last_s`. A time that exceeds the end by rounding only
// is the end. Throws for later times.
double TimeInScene(double time_s, double last_s, const std::string& what) {
  constexpr double kRounded = 1e-5;
  if (time_s < 0.0 || time_s > (1.0 + kRounded) * last_s) {
    throw InvalidArgument(
        "{} is at {:g} s, but the scene lasts from 0 to {:g} s", what, time_s, last_s);
  }
  return std::min(time_s, last_s);
}

// Times in a file of cameras. Throws if only some of its frames have one.
bool ReadTimes(const std::vector<FileCamera>& file, const Scene& scene, Stations* stations) {
  if (!scene.HasTimes()) return false;
  const bool has_times = file[0].time_s.has_value();
  const double last_s = scene.Times().back();
  for (size_t i = 0; i < file.size(); ++i) {
    if (file[i].time_s.has_value() != has_times) {
      throw InvalidArgument(
          "the file of cameras: frame {} has {} time, unlike those before it; give a time to every "
          "frame, or to none",
          i,
          has_times ? "no" : "a");
    }
    if (!has_times) continue;
    stations->cameras[i].time_s =
        TimeInScene(*file[i].time_s, last_s, fmt::format("the file of cameras: frame {}", i));
  }
  return has_times;
}

Stations CamerasOfFile(const RenderOptions& options, const Scene& scene, const Camera& home) {
  const std::string text = ReadFile(options.cameras, kMaxFileBytes);
  const std::vector<FileCamera> file =
      ReadCameraFile(text, "the file of cameras", scene, home, kMaxMovieFrames);
  Stations stations;
  for (const FileCamera& camera : file) {
    stations.cameras.push_back({camera.camera, camera.cam_from_world});
  }
  stations.have_times = ReadTimes(file, scene, &stations);
  return stations;
}

std::vector<PathCamera> CamerasOfViews(const RenderOptions& options, const Scene& scene, int home) {
  std::vector<int> order;
  for (const std::string& name : options.views) order.push_back(scene.FindView(name));
  if (order.empty()) order = scene.HasTimes() ? scene.FramesInShot(home) : ViewsInOrder(scene);
  std::vector<PathCamera> cameras;
  for (const int index : order) {
    const View& view = scene.views[index];
    cameras.push_back({view.camera, view.cam_from_world, view.time_s()});
  }
  return cameras;
}

// The camera of the view, standing still, at all times.
std::vector<PathCamera> StillCamera(const Scene& scene, int home) {
  std::vector<PathCamera> cameras;
  for (const double time_s : scene.Times()) {
    cameras.push_back({scene.views[home].camera, scene.views[home].cam_from_world, time_s});
  }
  return cameras;
}

// Returns true if a movie without a given length shows every camera of its path once.
bool ShowsEachCameraOnce(const RenderOptions& options, const Scene& scene) {
  using Path = RenderOptions::Path;
  return options.path == Path::kCameras || options.path == Path::kStill ||
         (options.path == Path::kPhotos && scene.HasTimes());
}

// The cameras as they are, and back again for --bounce.
std::vector<PathCamera> EachCameraOnce(std::vector<PathCamera> cameras, bool bounce) {
  const size_t count = cameras.size();
  for (size_t i = count - 1; bounce && i-- > 1;) cameras.push_back(cameras[i]);
  return cameras;
}

// Times of the frames if the path has none: the whole time of the scene, and back if the path goes
// back.
void SpreadTimes(bool bounce, const Scene& scene, std::vector<PathCamera>* frames) {
  const std::vector<double> times = scene.Times();
  const double last = std::max<double>(1.0, static_cast<double>(frames->size()) - 1.0);
  for (size_t i = 0; i < frames->size(); ++i) {
    double share = static_cast<double>(i) / last;
    if (bounce) share = 1.0 - std::abs(2.0 * share - 1.0);
    (*frames)[i].time_s = times.front() + share * (times.back() - times.front());
  }
}

// Time at a position on a smooth path, interpolated between its stations.
double TimeOnPath(const SmoothPath& path, const std::vector<PathCamera>& stations, double share) {
  size_t next = 1;
  while (next + 1 < stations.size() && path.KnotAt(next) < share) ++next;
  if (next >= stations.size()) return stations[0].time_s;
  const double begin = path.KnotAt(next - 1), end = path.KnotAt(next);
  const double part = std::clamp((share - begin) / std::max(1e-12, end - begin), 0.0, 1.0);
  return std::lerp(stations[next - 1].time_s, stations[next].time_s, part);
}

Eigen::Vector3d FocusOfView(const View& view, const GaussianModel& model, ThreadPool& pool) {
  const Camera small = view.camera.FitWithin(kFocusSidePx);
  return FocusOf(view, small, RenderView(model, view, small, pool).median_depth);
}

// The camera at the size of all frames.
Camera PictureOf(const RenderOptions& options, const Stations& stations, const View& home) {
  Camera picture =
      options.path == RenderOptions::Path::kCameras ? stations.cameras[0].camera : home.camera;
  picture = picture.FitWithin(options.max_side_px);
  picture.width -= picture.width % 2;  // movies need even sizes
  picture.height -= picture.height % 2;
  if (std::min(picture.width, picture.height) >= kLeastSidePx) return picture;
  throw InvalidArgument(
      "frames of {} x {} px are too small; their shorter side must be at least "
      "{} px: ask for a larger max_side_px or for cameras of another shape",
      picture.width,
      picture.height,
      kLeastSidePx);
}

Stations PathStations(const RenderOptions& options, const Scene& scene, int home) {
  using Path = RenderOptions::Path;
  switch (options.path) {
    case Path::kCameras:
      return CamerasOfFile(options, scene, scene.views[home].camera);
    case Path::kPhotos:
      return {CamerasOfViews(options, scene, home), scene.HasTimes()};
    case Path::kStill:
      return {StillCamera(scene, home), true};
    default:
      return {};
  }
}

// Cameras along a smooth path, with times if the file has them.
std::vector<PathCamera> SmoothFrames(const RenderOptions& options,
                                     const Stations& stations,
                                     double unit,
                                     bool file_tells) {
  const SmoothPath path(stations.cameras, unit);
  std::vector<PathCamera> frames;
  for (const double share :
       FrameShares(options.frames.value_or(kDefaultMovieFrames), options.bounce, false)) {
    frames.push_back(path.At(share));
    if (file_tells) frames.back().time_s = TimeOnPath(path, stations.cameras, share);
  }
  return frames;
}

std::vector<PathCamera> OrbitFrames(const RenderOptions& options,
                                    const Scene& scene,
                                    int home,
                                    const Eigen::Vector3d& focus,
                                    const Camera& picture) {
  const std::vector<double> shares =
      FrameShares(options.frames.value_or(kDefaultMovieFrames), options.bounce, true);
  std::vector<PathCamera> frames = TurnFrames(scene, home, focus, shares);
  for (PathCamera& frame : frames) {
    frame.camera = CoverPicture(frame.camera, picture.width, picture.height);
  }
  return frames;
}

// The cameras of the frames, all of one size, each with its time.
std::vector<PathCamera> FramesOf(const RenderOptions& options,
                                 const Scene& scene,
                                 int home,
                                 const GaussianModel& model,
                                 StageContext& context) {
  const View& view = scene.views[home];
  Stations stations = PathStations(options, scene, home);
  const Camera picture = PictureOf(options, stations, view);
  for (PathCamera& station : stations.cameras) {
    station.camera = CoverPicture(station.camera, picture.width, picture.height);
  }
  const bool one_by_one = !options.frames && ShowsEachCameraOnce(options, scene);
  const bool file_tells = stations.have_times && options.path == RenderOptions::Path::kCameras;
  std::vector<PathCamera> frames;
  if (one_by_one) {
    frames = EachCameraOnce(stations.cameras, options.bounce);
  } else {
    const Eigen::Vector3d focus = FocusOfView(view, model, context.pool());
    const double unit = (focus - view.cam_from_world.Center()).norm();
    frames = options.path == RenderOptions::Path::kOrbit
                 ? OrbitFrames(options, scene, home, focus, picture)
                 : SmoothFrames(options, stations, unit, file_tells);
  }
  const bool told = file_tells || (one_by_one && stations.have_times);
  if (!told && scene.HasTimes()) SpreadTimes(options.bounce, scene, &frames);
  if (!options.time_s) return frames;
  const double time_s =
      TimeInScene(*options.time_s, scene.Times().back(), "the requested time (time_s)");
  for (PathCamera& frame : frames) frame.time_s = time_s;
  return frames;
}

// Clock for frames at the times of the scene; nullopt for evenly spaced frames.
std::optional<FilmClock> ClockOfScene(const RenderOptions& options,
                                      const Scene& scene,
                                      const std::vector<PathCamera>& frames,
                                      const StageContext& context) {
  const bool own = !options.frames && !options.time_s && frames.size() > 1 && scene.HasTimes() &&
                   options.path != RenderOptions::Path::kCameras &&
                   ShowsEachCameraOnce(options, scene);
  if (!own || !TimesAreSeconds(scene, FindImportFacts(context))) return std::nullopt;
  std::vector<double> times;
  for (const PathCamera& frame : frames) times.push_back(frame.time_s);
  return ClockOf(times);
}

Mp4Options MovieOf(const RenderOptions& options,
                   const Scene& scene,
                   int home,
                   const std::vector<PathCamera>& frames,
                   const std::optional<FilmClock>& clock,
                   StageContext& context) {
  Mp4Options movie{.width = frames[0].camera.width,
                   .height = frames[0].camera.height,
                   .frames_per_second = options.frames_per_second,
                   .cancel = &context.cancel()};
  if (!clock) return movie;
  movie.frames_per_second = clock->frames_per_second;
  movie.ticks_per_second = clock->ticks_per_second;
  // Named views need not be in the order in which they were filmed.
  if (options.views.empty() && !options.bounce) {
    movie.sound = SoundFrom(scene, home, frames[0].time_s, *clock, context);
  }
  return movie;
}

constexpr char kOtherCodec[] = "mpeg4";  // FFmpeg's own, for machines without H.264

void WarnOf(const Mp4Writer& movie, StageContext& context) {
  if (movie.encoder() == kOtherCodec) {
    context.Warn(
        "this machine's libavcodec has no H.264 encoder (libx264): the movie is MPEG-4 part 2, "
        "which browsers do not show");
  }
  if (!movie.sound_warning().empty()) context.Warn(movie.sound_warning());
}

// The frames of a movie, the time of each, and how they are encoded.
struct Filming {
  std::vector<PathCamera> frames;
  std::optional<FilmClock> clock;
  Mp4Options movie;
};

Filming FilmingOf(const RenderOptions& options,
                  const Scene& scene,
                  const GaussianModel& model,
                  StageContext& context) {
  if (!scene.HasTimes() && (options.path == RenderOptions::Path::kStill || options.time_s)) {
    throw InvalidArgument("this scene has no times: path still and time_s need a dynamic scene");
  }
  const int home = HomeView(scene, context);
  Filming filming{.frames = FramesOf(options, scene, home, model, context)};
  filming.clock = ClockOfScene(options, scene, filming.frames, context);
  filming.movie = MovieOf(options, scene, home, filming.frames, filming.clock, context);
  return filming;
}

// Renders all frames, and passes each to `movie`, if there is one, and to `on_picture`.
void Shoot(const Filming& filming,
           const GaussianModel& model,
           Mp4Writer* movie,
           const std::function<void(int64_t, const Image&)>& on_picture,
           StageContext& context) {
  const int64_t count = std::ssize(filming.frames);
  for (int64_t i = 0; i < count; ++i) {
    context.ThrowIfCancelled();
    const PathCamera& frame = filming.frames[i];
    const Image srgb = SrgbFromLab(
        RenderView(model, frame.camera, frame.cam_from_world, context.pool(), 0.0f, frame.time_s)
            .lab,
        context.pool());
    if (movie != nullptr && filming.clock) {
      movie->AddAt(filming.clock->time_s[i], filming.clock->seconds[i], srgb, context.pool());
    } else if (movie != nullptr) {
      movie->Add(srgb, context.pool());
    }
    on_picture(i, srgb);
    context.ReportProgress(i + 1, count, "rendering frames");
  }
  if (movie != nullptr) movie->Finish();
}

}  // namespace

void RenderMovie(const RenderOptions& options,
                 const Scene& scene,
                 const GaussianModel& model,
                 StageContext& context) {
  const Filming filming = FilmingOf(options, scene, model, context);
  if (options.pictures && filming.frames.size() > kMaxMoviePictures) {
    throw InvalidArgument(
        "{} frames are too many to keep as pictures; the limit is {}: ask for "
        "fewer frames, or for the video only",
        filming.frames.size(),
        kMaxMoviePictures);
  }
  const std::filesystem::path file = context.scratch_folder() / artifact::kMovie;
  std::optional<Mp4Writer> movie;
  if (options.video) {
    movie.emplace(file, filming.movie);
    WarnOf(*movie, context);
  }
  const auto keep = [&](int64_t i, const Image& srgb) {
    if (!options.pictures) return;
    context.WriteOutput(fmt::format("{}{:05}.png", artifact::kFrames, i + 1), EncodePng8(srgb));
  };
  Shoot(filming, model, movie ? &*movie : nullptr, keep, context);
  if (movie) context.MoveOutput(artifact::kMovie, file);
}

bool RenderMovieFile(const RenderOptions& options,
                     const Scene& scene,
                     const GaussianModel& model,
                     const std::filesystem::path& file,
                     StageContext& context) {
  const Filming filming = FilmingOf(options, scene, model, context);
  Mp4Writer movie(file, filming.movie);
  if (movie.encoder() == kOtherCodec) return false;
  Shoot(
      filming, model, &movie, [](int64_t, const Image&) {}, context);
  return true;
}

}  // namespace color3d
