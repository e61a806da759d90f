#include "core/stage/movie/page_movie.h"

#include <filesystem>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/movie/movie.h"
#include "core/video/film_reader.h"

namespace color3d {
namespace {

constexpr int kTurnSidePx = 400, kFilmSidePx = 480;  // longer side
constexpr int kTurnFrames = 72;
constexpr double kTurnFramesPerSecond = 12.0;
constexpr size_t kMostFilmFrames = 600;        // longer films are thinned out, and silent
constexpr double kFilmFramesPerSecond = 25.0;  // where times are not seconds

RenderOptions OptionsOf(const Scene& scene, bool moves, int key_view) {
  RenderOptions options;
  if (!moves) {
    options.path = RenderOptions::Path::kOrbit;
    options.max_side_px = kTurnSidePx;
    options.frames = kTurnFrames;
    options.frames_per_second = kTurnFramesPerSecond;
    return options;
  }
  options.path = RenderOptions::Path::kPhotos;
  options.max_side_px = kFilmSidePx;
  options.frames_per_second = kFilmFramesPerSecond;
  if (scene.FramesInShot(key_view).size() > kMostFilmFrames) {
    options.frames = static_cast<int>(kMostFilmFrames);
  }
  return options;
}

}  // namespace

PageMovie MakePageMovie(const Scene& scene, const GaussianModel& model, StageContext& context) {
  const std::filesystem::path file = context.scratch_folder() / "page.mp4";
  PageMovie movie;
  movie.shows_motion = model.IsDynamic() && scene.HasTimes();
  const RenderOptions options = OptionsOf(scene, movie.shows_motion, ReadKeyView(context, scene));
  try {
    if (RenderMovieFile(options, scene, model, file, context)) {
      movie.has_sound = FilmReader(file, &context.cancel()).facts().has_sound;
      movie.bytes = ReadFile(file);
    }
  } catch (const Error& e) {
    // No encoder, or no movie of this shape: the page does without.
    if (e.code() != ErrorCode::kFailedPrecondition && e.code() != ErrorCode::kInvalidArgument) {
      throw;
    }
  }
  std::error_code none;
  std::filesystem::remove(file, none);
  return movie;
}

}  // namespace color3d
