#include "core/stage/film_import/import_film.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/range_check.h"
#include "core/catalogue/scene_files.h"
#include "core/color/lab.h"
#include "core/film/shots.h"
#include "core/film/steady_tones.h"
#include "core/image/codec.h"
#include "core/scene/import/hold_out.h"
#include "core/scene/import/import.h"
#include "core/scene/key_photo.h"
#include "core/stage/film_import/film_frames.h"
#include "core/stage/film_import/film_poses.h"
#include "core/stage/formats/artifact_io.h"
#include "core/video/film_reader.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// The requested frames, read one by one: sRGB or grey.
struct FrameStream {
  int count = 0;
  std::function<double(int)> time_s;
  std::function<Image(int)> read;  // throws Error{kDataLoss} for a damaged frame
  std::function<std::string(int)> name;
  bool is_video = false;
};

// Indices of the requested frames, at least two.
std::vector<int> RequestedFilmFrames(const std::vector<double>& times, const FilmOptions& options) {
  std::vector<int> wanted = RequestedFrames(times, options);
  CheckFrameCount(wanted.size(), times[wanted.back()] - times[wanted.front()], options);
  if (wanted.size() == 1) {
    throw InvalidArgument(
        "a film needs at least two frames, and one was requested; give a longer film, or request "
        "more frames (film_stride, film_begin_s, film_end_s)");
  }
  return wanted;
}

void AssignShots(const FilmShots& shots, Scene* scene, StageContext& context) {
  std::vector<std::string> blank, alien, cuts;
  for (size_t i = 0; i < scene->views.size(); ++i) {
    View& view = scene->views[i];
    view.moment->shot = shots.shot[i];
    if (shots.fault[i] == FrameFault::kBlank) blank.push_back(view.name);
    if (shots.fault[i] == FrameFault::kAlien) alien.push_back(view.name);
  }
  for (const int frame : shots.cuts) cuts.push_back(scene->views[frame].name);
  WarnOfFrames(blank, "with no detail", context);
  WarnOfFrames(alien, "unlike their neighbours (torn?), coloured on their own", context);
  if (cuts.empty()) return;
  context.Warn(
      "the film has cuts before {}: {} shots; a key view colours its own shot by optical flow and "
      "other shots by similarity. Colour a frame of each shot (additional key views; the selection "
      "of "
      "several key views proposes one for each shot)",
      NamesOfFrames(cuts),
      cuts.size() + 1);
}

// The frames that can be decoded.
struct ReadFrames {
  Scene scene;
  std::vector<int> index;         // of each view, in the stream
  std::vector<Image> thumbnails;  // to find shots
  std::vector<Image> tones;       // to steady exposure; empty without deflicker
};

View ViewOf(const FrameStream& stream, int i, const Image& luminance, bool is_written) {
  View view;
  view.name = stream.name(i);
  view.image_file = std::string(kFramesFolder) + view.name;
  if (is_written) {
    view.image_file =
        artifact::kGivenViews + fs::path(view.name).replace_extension(".png").string();
  }
  view.camera = view.captured_camera = GuessedCamera(luminance.width, luminance.height);
  view.moment = Moment{stream.time_s(i), 0};
  return view;
}

// Writes the frame to the scratch folder until all frames are known.
void StoreFrame(const View& view, Image luminance, const StageContext& context) {
  const fs::path file = context.scratch_folder() / view.image_file;
  fs::create_directories(file.parent_path());
  WriteFileAtomic(file, EncodeGrayFrame(std::move(luminance)));
}

ReadFrames ReadAll(const FrameStream& stream, bool deflicker, StageContext& context) {
  ReadFrames frames;
  std::vector<View>& views = frames.scene.views;
  std::vector<std::string> damaged;
  for (int i = 0; i < stream.count; ++i) {
    context.ThrowIfCancelled();
    context.ReportProgress(i, stream.count, "reading frames");
    Image luminance;
    try {
      luminance = LuminanceFromSrgb(stream.read(i));
    } catch (const Error& e) {
      if (e.code() != ErrorCode::kDataLoss) throw;
      damaged.push_back(stream.name(i));
      continue;
    }
    View view = ViewOf(stream, i, luminance, stream.is_video || deflicker);
    if (views.empty()) CheckMovieSize(view.name, view.camera.width, view.camera.height);
    if (!views.empty() && (view.camera.width != views[0].camera.width ||
                           view.camera.height != views[0].camera.height)) {
      throw InvalidArgument(
          "{} has {} x {} px, but {} has {} x {} px; all frames of a film must have one size",
          view.name,
          view.camera.width,
          view.camera.height,
          views[0].name,
          views[0].camera.width,
          views[0].camera.height);
    }
    frames.thumbnails.push_back(FitWithin(luminance, kShotThumbnailPx));
    if (deflicker) frames.tones.push_back(FitWithin(luminance, kTonePicturePx));
    if (stream.is_video && !deflicker) StoreFrame(view, std::move(luminance), context);
    views.push_back(std::move(view));
    frames.index.push_back(i);
  }
  WarnOfFrames(damaged, "cannot be decoded and are left out", context);
  if (views.size() < 2) {
    throw InvalidArgument(
        "{} of {} frames can be decoded; a film needs at least two", views.size(), stream.count);
  }
  CheckStemsAreUnique(frames.scene);
  return frames;
}

// Writes every frame with steadied exposure.
void WriteSteady(const FrameStream& stream, const ReadFrames& frames, StageContext& context) {
  std::vector<int> shot;
  for (const View& view : frames.scene.views) shot.push_back(view.moment->shot);
  const SteadyTones tones = FindSteadyTones(frames.tones, shot, context.pool(), context.cancel());
  const auto count = static_cast<int>(frames.index.size());
  for (int i = 0; i < count; ++i) {
    context.ThrowIfCancelled();
    context.ReportProgress(i, count, "steadying exposure");
    StoreFrame(frames.scene.views[i],
               ApplyToneCurve(LuminanceFromSrgb(stream.read(frames.index[i])), tones.curves[i]),
               context);
  }
  constexpr double kUnchangedL = 1e-6;
  if (std::abs(tones.flicker_before - tones.flicker_after) < kUnchangedL) {
    return context.Warn("exposure is steady (mean change between frames {:.2f} L) and is kept",
                        tones.flicker_before);
  }
  context.Warn(
      "exposure is steadied: mean change between frames {:.2f} L before, {:.2f} L after; the "
      "coloured film has the steadied luminance",
      tones.flicker_before,
      tones.flicker_after);
}

void ImportFrames(const FrameStream& stream,
                  const FilmOptions& options,
                  const ImportOptions& import,
                  StageContext& context) {
  ReadFrames frames = ReadAll(stream, options.deflicker, context);
  Scene& scene = frames.scene;
  AssignShots(FindShots(frames.thumbnails), &scene, context);
  if (options.deflicker) WriteSteady(stream, frames, context);
  const bool is_written = stream.is_video || options.deflicker;
  ImportFacts facts;
  facts.layout = CaptureLayout::kFilm;
  facts.photos_found = stream.count;
  facts.photos_registered = static_cast<int>(scene.views.size());
  if (options.poses == FilmPoses::kAuto) {
    FindFilmPoses(is_written ? context.scratch_folder() : context.scene_folder(),
                  import,
                  context,
                  &scene,
                  &facts);
  }
  if (is_written) {
    for (const View& view : scene.views) {
      context.MoveOutput(view.image_file, context.scratch_folder() / view.image_file);
    }
  }
  std::vector<std::string> warnings;
  if (import.hold_out_every_eighth) HoldOutEveryEighth(&scene, &warnings);
  if (import.hold_out_block > 0.0) HoldOutBlock(import.hold_out_block, &scene);
  for (const std::string& warning : warnings) context.Warn(warning);
  context.WriteOutput(artifact::kScene, SceneToJson(scene));
  context.WriteOutput(artifact::kImportFacts, ImportFactsToJson(facts));
}

void ImportVideo(const std::string& file,
                 const FilmOptions& options,
                 const ImportOptions& import,
                 StageContext& context) {
  if (options.frames_per_second) {
    throw InvalidArgument(
        "film_frames_per_second is for frames that come as pictures; {} has times of its own",
        file);
  }
  FilmReader film(context.scene_folder() / file, &context.cancel());
  const std::vector<int> wanted = RequestedFilmFrames(film.times(), options);
  if (film.facts().interlaced) {
    context.Warn("the film is interlaced: one field of each frame is taken");
  }
  for (const std::string& note : film.facts().notes) {
    context.Warn("the film " + note);
  }
  FrameStream stream;
  stream.count = static_cast<int>(wanted.size());
  stream.is_video = true;
  stream.time_s = [&](int i) { return film.times()[wanted[i]]; };
  stream.read = [&](int i) { return film.Read(wanted[i]); };
  stream.name = [&](int i) { return fmt::format("f{:06}.png", wanted[i]); };
  ImportFrames(stream, options, import, context);
}

void ImportPictures(const FilmOptions& options,
                    const ImportOptions& import,
                    StageContext& context) {
  const fs::path folder = context.scene_folder() / kFramesFolder;
  const std::vector<std::string> files = PicturesIn(folder);
  const std::vector<double> times = TimesOfPictures(files, options, context);
  const std::vector<int> wanted = RequestedFilmFrames(times, options);
  FrameStream stream;
  stream.count = static_cast<int>(wanted.size());
  stream.time_s = [&](int i) { return times[wanted[i]]; };
  stream.read = [&](int i) {
    return ReadKeyPhoto(folder / files[wanted[i]], context.MemoryBytes());
  };
  stream.name = [&](int i) { return files[wanted[i]]; };
  ImportFrames(stream, options, import, context);
}

}  // namespace

void FilmOptions::Validate() const {
  const RangeCheck check("film option");
  check("stride", stride, 1, 1000);
  check("begin_s", begin_s, 0, 1e6);
  if (end_s) check("end_s", *end_s, 0.01, 1e6);
  if (frames_per_second) check("frames_per_second", *frames_per_second, 1, 120);
  if (end_s && *end_s <= begin_s) {
    throw InvalidArgument("film_end_s is {} s, before film_begin_s ({} s)", *end_s, begin_s);
  }
}

std::string FindFilm(const std::vector<std::string>& files) {
  std::string film;
  for (const std::string& file : files) {
    if (IsFrameFile(file) && HasImageExtension(file)) return std::string(kFramesFolder);
    if (HasFilmExtension(file) && !IsAugmentFile(file)) film = file;
  }
  return film;
}

void ImportFilm(const std::string& film,
                const FilmOptions& options,
                const ImportOptions& import,
                StageContext& context) {
  options.Validate();
  if (!import.hold_out_camera.empty()) {
    throw InvalidArgument(
        "hold_out_camera is '{}', but a film is of one camera; leave it out, or hold out every "
        "eighth frame",
        import.hold_out_camera);
  }
  if (film == kFramesFolder) return ImportPictures(options, import, context);
  ImportVideo(film, options, import, context);
}

}  // namespace color3d
