#include "core/stage/film_import/import_camera_films.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/catalogue/scene_files.h"
#include "core/color/lab.h"
#include "core/film/shots.h"
#include "core/image/codec.h"
#include "core/scene/frame_times.h"
#include "core/stage/film_import/camera_poses.h"
#include "core/stage/film_import/film_frames.h"
#include "core/stage/film_import/footage.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/import_output.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Warns if the cameras share few times, because their rates or start times differ.
void WarnOfDifferentTimes(const std::vector<View>& views, size_t longest, StageContext& context) {
  std::set<double> times;
  for (const View& view : views) times.insert(view.time_s());
  if (2 * times.size() <= 3 * longest) return;
  context.Warn(
      "the cameras' frames were not taken at the same times ({} times, {} frames of one camera): "
      "are their rates the same?",
      times.size(),
      longest);
}

// Makes views of the frames of all cameras.
class CameraFilmsImport {
 public:
  // `all` outlives the object.
  CameraFilmsImport(const std::vector<Footage>& all, StageContext& context)
      : all_(all), context_(context) {
    for (const Footage& footage : all) count_ += static_cast<int>(footage.frames.size());
  }

  ImportResult Import(const ImportOptions& options) {
    for (const Footage& footage : all_) ReadFilm(footage);
    WarnOfFrames(damaged_, "cannot be decoded and are left out", context_);
    if (frames_.views.empty())
      throw InvalidArgument("none of the {} frames can be decoded", count_);
    ImportResult result;
    if (all_[0].film.has_pose) {
      std::ranges::sort(frames_.views, {}, &View::name);
      result.scene = std::move(frames_);
      result.layout = CaptureLayout::kPosedFilms;
    } else {
      result = Place(options);
      result.layout = CaptureLayout::kFilms;
    }
    result.photos_found = count_;
    AssignTimes(&result);
    FinishPosedScene(options, &result);
    KeepFrames(result.scene);
    return result;
  }
  const std::optional<FilmFindings>& findings() const { return findings_; }

 private:
  bool AreVideos() const { return !all_[0].film.is_pictures; }
  // Folder that image_file of the views is relative to.
  fs::path FramesRoot() const {
    return AreVideos() ? context_.scratch_folder() : context_.scene_folder();
  }

  void ReadFilm(const Footage& footage) {
    FootageReader reader(footage, context_);
    if (reader.interlaced()) {
      context_.Warn(footage.film.file + " is interlaced: one field of each frame is taken");
    }
    for (const std::string& note : reader.notes()) {
      context_.Warn(footage.film.file + " " + note);
    }
    FramesOfCamera camera{footage.film.file, {}};
    std::vector<Image> thumbnails;
    for (const int frame : footage.frames) {
      context_.ThrowIfCancelled();
      context_.ReportProgress(done_++, count_, "reading frames");
      const std::string name = footage.film.camera + "/" + reader.NameOf(frame);
      Image luminance;
      try {
        luminance = LuminanceFromSrgb(reader.Read(frame));
      } catch (const Error& e) {
        if (e.code() != ErrorCode::kDataLoss) throw;
        damaged_.push_back(name);
        continue;
      }
      if (!footage.film.has_pose) thumbnails.push_back(FitWithin(luminance, kShotThumbnailPx));
      camera.views.push_back(static_cast<int>(frames_.views.size()));
      times_[name] = {name, footage.film.file, footage.times[frame], footage.film.camera};
      AddView(footage, name, std::move(luminance));
    }
    if (footage.film.has_pose || camera.views.empty()) return;
    RequireOneShot(camera, thumbnails);
    cameras_.push_back(std::move(camera));
  }

  void AddView(const Footage& footage, const std::string& name, Image luminance) {
    View view = footage.film.view;
    if (!footage.film.has_pose) {
      view.camera = view.captured_camera = GuessedCamera(luminance.width, luminance.height);
    }
    view.name = name;
    view.image_file =
        AreVideos() ? artifact::kGivenViews + name : std::string(kFramesFolder) + name;
    if (AreVideos()) {
      const fs::path file = FramesRoot() / view.image_file;
      fs::create_directories(file.parent_path());
      WriteFileAtomic(file, EncodeGrayFrame(std::move(luminance)));
    } else {
      CheckMovieSize(view.name, luminance.width, luminance.height);
    }
    frames_.views.push_back(std::move(view));
  }

  void RequireOneShot(const FramesOfCamera& camera, const std::vector<Image>& thumbnails) const {
    const FilmShots shots = FindShots(thumbnails);
    if (shots.cuts.empty()) return;
    throw InvalidArgument(
        "{} has a cut before {}: to estimate the poses of several cameras, each film must be one "
        "shot; take a part without cuts (film_begin_s, film_end_s), or split the films",
        camera.film,
        frames_.views[camera.views[shots.cuts.front()]].name);
  }

  ImportResult Place(const ImportOptions& options) {
    PlacedCameras placed = PlaceCameras(FramesRoot(), frames_, cameras_, options, context_);
    findings_ = placed.findings;
    return std::move(placed.result);
  }

  void AssignTimes(ImportResult* result) {
    std::vector<FrameTime> times;
    std::map<std::string, size_t> frames;
    for (const View& view : result->scene.views) {
      times.push_back(times_.at(view.name));
      ++frames[times.back().camera];
    }
    FrameMoments moments = AssignMoments(times);
    for (size_t i = 0; i < times.size(); ++i) result->scene.views[i].moment = moments.moments[i];
    result->cameras = std::move(moments.cameras);
    if (!moments.note.empty()) result->warnings.push_back(std::move(moments.note));
    size_t longest = 0;
    for (const auto& [camera, count] : frames) longest = std::max(longest, count);
    if (result->scene.views[0].moment) WarnOfDifferentTimes(result->scene.views, longest, context_);
  }

  void KeepFrames(const Scene& scene) {
    if (!AreVideos()) return;
    for (const View& view : scene.views) {
      context_.MoveOutput(view.image_file, FramesRoot() / view.image_file);
    }
  }

  const std::vector<Footage>& all_;
  StageContext& context_;
  int count_ = 0, done_ = 0;
  Scene frames_;                            // views of all cameras
  std::vector<FramesOfCamera> cameras_;     // in frames_; only if poses are estimated
  std::map<std::string, FrameTime> times_;  // by the view's name
  std::vector<std::string> damaged_;
  std::optional<FilmFindings> findings_;
};

ImportedAs KindOf(const CameraFilm& film) {
  if (film.has_pose) return ImportedAs::kPosedFilms;
  return film.is_pictures ? ImportedAs::kCameraPictures : ImportedAs::kCameraFilms;
}

}  // namespace

bool ImportCameraFilms(const ImportOptions& options,
                       const FilmOptions& film,
                       StageContext& context) {
  const std::vector<Footage> all = ReadFootage(film, context);
  if (all.empty()) return false;
  WarnOfUnusedOptions(film, KindOf(all[0].film), context);
  std::map<std::string, std::string> films;
  for (const Footage& footage : all) {
    films[footage.film.camera] = footage.film.is_pictures ? "" : footage.film.file;
  }
  CameraFilmsImport import(all, context);
  const ImportResult result = import.Import(options);
  WriteImported(result, context, films, import.findings());
  return true;
}

}  // namespace color3d
