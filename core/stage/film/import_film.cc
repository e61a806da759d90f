#include "core/stage/film/import_film.h"

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
#include "core/image/codec.h"
#include "core/scene/import.h"
#include "core/stage/film/film_frames.h"
#include "core/stage/film/film_poses.h"
#include "core/stage/formats/artifacts.h"
#include "core/video/film_reader.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr double kFramesPerSecond = 25.0;  // of pictures, whose times nobody tells
constexpr double kFocalOfLongerSide = 1.2;

// Pictures of all frames that are wanted, one after the other: sRGB or grey.
struct FrameStream {
  int count = 0;
  double frames_per_second = kFramesPerSecond;
  std::function<double(int)> time_s;
  std::function<Image(int)> read;  // throws Error{kDataLoss} for a damaged frame
  std::function<std::string(int)> name;
  bool is_video = false;
};

Camera UnknownCamera(int width, int height) {
  const double focal = kFocalOfLongerSide * std::max(width, height);
  return {width, height, focal, focal, 0.5 * width, 0.5 * height};
}

// Indices of the frames that are asked for.
std::vector<int> Wanted(const std::vector<double>& times, const FilmOptions& options) {
  std::vector<int> wanted = FramesAskedFor(times, options);
  CheckFrameCount(wanted.size(), options);
  if (wanted.size() == 1) {
    throw InvalidArgument("one frame is no film; colour it as a photo, by `color3d key color`");
  }
  return wanted;
}

void TellShots(const FilmShots& shots, Scene* scene, StageContext& context) {
  std::vector<std::string> blank, alien, cuts;
  int last = -1;
  for (size_t i = 0; i < scene->views.size(); ++i) {
    View& view = scene->views[i];
    view.moment->shot = shots.shot[i];
    if (shots.fault[i] == FrameFault::kBlank) blank.push_back(view.name);
    if (shots.fault[i] == FrameFault::kAlien) alien.push_back(view.name);
    if (shots.fault[i] != FrameFault::kNone) continue;
    if (last >= 0 && shots.shot[i] != last) cuts.push_back(view.name);
    last = shots.shot[i];
  }
  WarnOfFrames(blank, "of one grey all over", context);
  WarnOfFrames(alien, "unlike those around (torn?), coloured on their own", context);
  if (cuts.empty()) return;
  context.progress().OnWarning(fmt::format(
      "the film is cut before {}: {} shots; a key view colours its own shot by motion, others only "
      "by likeness. Colour a frame of each (further key views)",
      NamesOfFrames(cuts),
      cuts.size() + 1));
}

void ImportFrames(const FrameStream& stream,
                  const FilmOptions& options,
                  const ImportOptions& import,
                  StageContext& context) {
  Scene scene;
  std::vector<Image> thumbnails;
  std::vector<std::string> damaged, warnings;
  for (int i = 0; i < stream.count; ++i) {
    context.cancel().ThrowIfCancelled();
    context.progress().OnProgress(i, stream.count, "reading frames");
    Image luminance;
    try {
      luminance = LuminanceFromSrgb(stream.read(i));
    } catch (const Error& e) {
      if (e.code() != ErrorCode::kDataLoss) throw;
      damaged.push_back(stream.name(i));
      continue;
    }
    View view;
    view.name = stream.name(i);
    view.image_file =
        (stream.is_video ? std::string(artifact::kGivenViews) : std::string(kFramesFolder)) +
        view.name;
    view.camera = view.captured_camera = UnknownCamera(luminance.width, luminance.height);
    view.moment = Moment{stream.time_s(i), 0};
    if (!scene.views.empty() && (view.camera.width != scene.views[0].camera.width ||
                                 view.camera.height != scene.views[0].camera.height)) {
      throw InvalidArgument("{} has {} x {} px, but {} has {} x {} px: frames of a film are alike",
                            view.name,
                            view.camera.width,
                            view.camera.height,
                            scene.views[0].name,
                            scene.views[0].camera.width,
                            scene.views[0].camera.height);
    }
    thumbnails.push_back(FitWithin(luminance, kShotThumbnailPx));
    if (stream.is_video) {
      const fs::path file = context.scratch_folder() / view.image_file;
      fs::create_directories(file.parent_path());
      WriteFileAtomic(file, EncodeGrayFrame(std::move(luminance)));
    }
    scene.views.push_back(std::move(view));
  }
  WarnOfFrames(damaged, "cannot be decoded and are left out", context);
  if (scene.views.size() < 2) {
    throw InvalidArgument("{} of {} frames can be decoded; a film has two at least",
                          scene.views.size(),
                          stream.count);
  }
  TellShots(FindShots(thumbnails), &scene, context);
  ImportFacts facts;
  facts.layout = "film";
  facts.photos_found = stream.count;
  facts.photos_registered = static_cast<int>(scene.views.size());
  if (options.poses == FilmPoses::kAuto) {
    FindFilmPoses(stream.is_video ? context.scratch_folder() : context.scene_folder(),
                  import,
                  context,
                  &scene,
                  &facts);
  }
  if (stream.is_video) {
    for (const View& view : scene.views) {
      context.TakeOutput(view.image_file, context.scratch_folder() / view.image_file);
    }
  }
  if (import.hold_out_every_eighth) HoldOutEveryEighth(&scene, &warnings);
  for (const std::string& warning : warnings) context.progress().OnWarning(warning);
  context.WriteOutput(artifact::kScene, SceneToJson(scene));
  context.WriteOutput(artifact::kImportFacts, ImportFactsToJson(facts));
}

void ImportVideo(const std::string& file,
                 const FilmOptions& options,
                 const ImportOptions& import,
                 StageContext& context) {
  FilmReader film(context.scene_folder() / file);
  const std::vector<int> wanted = Wanted(film.times(), options);
  if (!film.facts().constant_rate) {
    context.progress().OnWarning(
        "the frames of the film do not follow each other evenly; the coloured film shows each for "
        "the same time");
  }
  if (film.facts().interlaced) {
    context.progress().OnWarning("the film is interlaced: one field of each frame is taken");
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
  std::vector<std::string> files;
  for (const std::string& file : ListFiles(folder)) {
    if (HasImageExtension(file)) files.push_back(file);
  }
  std::sort(files.begin(), files.end());
  std::vector<double> times;
  for (size_t i = 0; i < files.size(); ++i)
    times.push_back(static_cast<double>(i) / kFramesPerSecond);
  const std::vector<int> wanted = Wanted(times, options);
  FrameStream stream;
  stream.count = static_cast<int>(wanted.size());
  stream.time_s = [&](int i) { return times[wanted[i]]; };
  stream.read = [&](int i) { return ReadImage(folder / files[wanted[i]]); };
  stream.name = [&](int i) { return files[wanted[i]]; };
  ImportFrames(stream, options, import, context);
}

}  // namespace

void FilmOptions::Validate() const {
  const RangeCheck check("film option");
  check("stride", stride, 1, 1000);
  check("begin_s", begin_s, 0, 1e6);
  if (end_s) check("end_s", *end_s, 0.01, 1e6);
  if (end_s && *end_s <= begin_s) {
    throw InvalidArgument("the film's part ends ({} s) before it begins ({} s)", *end_s, begin_s);
  }
}

std::string FindFilm(const fs::path& scene_folder) {
  std::string film;
  std::error_code none;
  if (!fs::is_directory(scene_folder, none)) return film;
  bool has_photos = false;
  int films = 0;
  for (const std::string& file : ListFiles(scene_folder)) {
    if (IsAugmentFile(file) || IsMaskFile(file)) continue;
    if (IsFrameFile(file) && HasImageExtension(file)) return std::string(kFramesFolder);
    has_photos |= HasImageExtension(file);
    if (!HasFilmExtension(file)) continue;
    film = file;
    ++films;
  }
  return has_photos || films != 1 ? "" : film;
}

void ImportFilm(const std::string& film,
                const FilmOptions& options,
                const ImportOptions& import,
                StageContext& context) {
  options.Validate();
  if (film == kFramesFolder) return ImportPictures(options, import, context);
  ImportVideo(film, options, import, context);
}

}  // namespace color3d
