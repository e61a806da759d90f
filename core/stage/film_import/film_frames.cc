#include "core/stage/film_import/film_frames.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/text/name_order.h"
#include "core/catalogue/film_rate.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/image/probe/probe.h"
#include "core/scene/camera.h"
#include "core/scene/frame_numbers.h"
#include "core/video/mp4_writer.h"

namespace color3d {
namespace {

constexpr size_t kNamed = 5;  // frames that a warning names

const char* ReasonForUnusedOptions(ImportedAs scene) {
  switch (scene) {
    case ImportedAs::kPosedFilms:
      return "films with poses have times of their own and are taken as exposed";
    case ImportedAs::kCameraFilms:
    case ImportedAs::kCameraPictures:
      return "films of several cameras are taken as exposed, at their own times";
    case ImportedAs::kTimedPictures:
      return "pictures with times and poses are all taken as exposed";
    case ImportedAs::kPhotos:
      break;
  }
  return "the scene is no film";
}

}  // namespace

std::vector<std::string> PicturesIn(const std::filesystem::path& folder) {
  std::vector<std::string> files;
  for (const std::string& file : ListFiles(folder)) {
    if (HasImageExtension(file)) files.push_back(file);
  }
  std::ranges::sort(files, ComesBefore);
  return files;
}

std::vector<double> TimesOfPictures(const std::vector<std::string>& files,
                                    const FilmOptions& options,
                                    StageContext& context) {
  const FrameNumbers numbers = FramePositions(files);
  if (!numbers.note.empty()) context.Warn(numbers.note);
  std::vector<double> times;
  for (const int64_t place : numbers.places) {
    times.push_back(static_cast<double>(place) /
                    options.frames_per_second.value_or(kDefaultFramesPerSecond));
  }
  return times;
}

std::vector<int> RequestedFrames(const std::vector<double>& times, const FilmOptions& options) {
  std::vector<int> wanted;
  int64_t inside = 0;
  for (size_t i = 0; i < times.size(); ++i) {
    if (times[i] < options.begin_s || (options.end_s && times[i] >= *options.end_s)) continue;
    if (inside++ % options.stride == 0) wanted.push_back(static_cast<int>(i));
  }
  if (wanted.empty()) {
    throw InvalidArgument(
        "the film has no frame in the requested part (film_begin_s, film_end_s); it lasts {:.2f} s",
        times.back());
  }
  return wanted;
}

void WarnOfUnusedOptions(const FilmOptions& options, ImportedAs scene, StageContext& context) {
  const FilmOptions usual;
  std::vector<std::string> unused;
  const auto add = [&](bool given, const char* name) {
    if (given) unused.emplace_back(name);
  };
  const bool pictures = scene == ImportedAs::kCameraPictures;
  const bool cameras = pictures || scene == ImportedAs::kCameraFilms;
  if (!cameras && scene != ImportedAs::kPosedFilms) {
    add(options.stride != usual.stride, "film_stride");
    add(options.begin_s != usual.begin_s, "film_begin_s");
    add(options.end_s != usual.end_s, "film_end_s");
  }
  add(!pictures && options.frames_per_second != usual.frames_per_second, "film_frames_per_second");
  add(options.deflicker != usual.deflicker, "film_deflicker");
  add(!cameras && options.poses != usual.poses, "film_poses");
  if (unused.empty()) return;
  context.Warn("{} {} ignored: {}",
               fmt::join(unused, ", "),
               unused.size() == 1 ? "is" : "are",
               ReasonForUnusedOptions(scene));
}

void CheckFrameCount(size_t frames, double seconds, const FilmOptions& options) {
  if (frames <= kMaxFilmFrames) return;
  throw InvalidArgument(
      "{} frames ({:.0f} s) exceed the limit of {}; set film_stride to {}, or take at most "
      "{:.0f} s (film_begin_s, film_end_s)",
      frames,
      seconds,
      kMaxFilmFrames,
      (frames * options.stride + kMaxFilmFrames - 1) / kMaxFilmFrames,
      std::floor(seconds * kMaxFilmFrames / static_cast<double>(frames)));
}

std::pair<int, int> MovieSize(int width, int height) {
  const Camera movie = Camera{width, height}.FitWithin(kMaxMovieSidePx);
  return {movie.width - movie.width % 2, movie.height - movie.height % 2};
}

void CheckMovieSize(const std::string& frames, int width, int height) {
  const auto [movie_width, movie_height] = MovieSize(width, height);
  if (std::min(movie_width, movie_height) >= kMinMovieSidePx) return;
  throw InvalidArgument(
      "{} has {} x {} px, which makes a movie of {} x {} px; the shorter side of a movie must be "
      "at "
      "least {} px: give larger frames, or frames of another shape",
      frames,
      width,
      height,
      movie_width,
      movie_height,
      kMinMovieSidePx);
}

std::string EncodeGrayFrame(Image luminance) {
  for (float& v : luminance.data) v = static_cast<float>(GrayFromLuminance(v));
  return EncodePng8(luminance);
}

std::string NamesOfFrames(const std::vector<std::string>& names) {
  std::string text;
  for (size_t i = 0; i < std::min(kNamed, names.size()); ++i) {
    text += (i == 0 ? "" : ", ") + names[i];
  }
  return names.size() > kNamed ? text + fmt::format(" and {} more", names.size() - kNamed) : text;
}

void WarnOfFrames(const std::vector<std::string>& names, const char* what, StageContext& context) {
  if (names.empty()) return;
  context.Warn("{} {} {}: {}",
               names.size(),
               names.size() == 1 ? "frame" : "frames",
               what,
               NamesOfFrames(names));
}

void WarnOfUnplacedFrames(const Scene& film,
                          const std::vector<int>& views,
                          const Scene& placed,
                          StageContext& context) {
  std::set<std::string> has_place;
  for (const View& view : placed.views) has_place.insert(view.name);
  std::vector<std::string> without;
  for (const int view : views) {
    if (!has_place.contains(film.views[view].name)) without.push_back(film.views[view].name);
  }
  WarnOfFrames(
      without, fmt::format("of {} without a pose, left out", views.size()).c_str(), context);
}

}  // namespace color3d
