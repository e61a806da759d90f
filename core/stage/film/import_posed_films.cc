#include "core/stage/film/import_posed_films.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/scene/frame_times.h"
#include "core/scene/posed_films.h"
#include "core/stage/film/film_frames.h"
#include "core/stage/formats/artifacts.h"
#include "core/stage/formats/import_output.h"
#include "core/video/film_reader.h"

namespace color3d {
namespace {

struct Footage {
  PosedFilm film;
  std::vector<int> frames;
};

std::vector<Footage> AllFootage(const FilmOptions& options, StageContext& context) {
  const auto size_of = [&](const std::string& file) {
    context.cancel().ThrowIfCancelled();
    const FilmReader reader(context.scene_folder() / file);
    return std::pair(reader.facts().width, reader.facts().height);
  };
  std::vector<Footage> all;
  size_t frames = 0;
  double seconds = 0.0;
  for (PosedFilm& film : ReadPosedFilms(context.scene_folder(), size_of)) {
    context.cancel().ThrowIfCancelled();
    const FilmReader reader(context.scene_folder() / film.file);
    all.push_back({std::move(film), {}});
    try {
      all.back().frames = FramesAskedFor(reader.times(), options);
    } catch (const Error& e) {
      throw Error(e.code(), "{}: {}", all.back().film.file, e.what());
    }
    const std::vector<int>& asked = all.back().frames;
    frames += asked.size();
    seconds = std::max(seconds, reader.times()[asked.back()] - reader.times()[asked.front()]);
  }
  CheckFrameCount(frames, seconds, options);
  return all;
}

// Cameras that run at their own rates or begin at odd times share no moment.
void WarnOfOddTimes(const std::vector<View>& views, size_t longest, StageContext& context) {
  std::set<double> times;
  for (const View& view : views) times.insert(view.time_s());
  if (2 * times.size() <= 3 * longest) return;
  context.progress().OnWarning(fmt::format(
      "the cameras' frames were not taken at the same times ({} times, {} frames of one camera): "
      "are their rates the same?",
      times.size(),
      longest));
}

class PosedFilmImport {
 public:
  explicit PosedFilmImport(StageContext& context) : context_(context) {}

  void Read(const std::vector<Footage>& all) {
    for (const Footage& footage : all) count_ += static_cast<int>(footage.frames.size());
    for (const Footage& footage : all) {
      FilmReader reader(context_.scene_folder() / footage.film.file);
      if (reader.facts().interlaced) {
        context_.progress().OnWarning(footage.film.file +
                                      " is interlaced: one field of each frame is taken");
      }
      for (const int frame : footage.frames) ReadFrame(footage.film, frame, &reader);
    }
    WarnOfFrames(damaged_, "cannot be decoded and are left out", context_);
    if (views_.empty()) throw InvalidArgument("none of the {} frames can be decoded", count_);
  }

  ImportResult Finish(const ImportOptions& options, size_t longest) {
    ImportResult result;
    FrameMoments moments = MomentsOf(times_);
    for (size_t i = 0; i < views_.size(); ++i) views_[i].moment = moments.moments[i];
    result.cameras = std::move(moments.cameras);
    if (!moments.note.empty()) result.warnings.push_back(std::move(moments.note));
    if (views_[0].moment) WarnOfOddTimes(views_, longest, context_);
    result.layout = SceneLayout::kPosedFilms;
    result.photos_found = count_;
    std::sort(
        views_.begin(), views_.end(), [](const View& x, const View& y) { return x.name < y.name; });
    result.scene.views = std::move(views_);
    FinishPosedScene(options, &result);
    return result;
  }

 private:
  void ReadFrame(const PosedFilm& film, int frame, FilmReader* reader) {
    context_.cancel().ThrowIfCancelled();
    context_.progress().OnProgress(done_++, count_, "reading frames");
    View view = film.view;
    view.name = fmt::format("{}/f{:06}.png", film.camera, frame);
    view.image_file = artifact::kGivenViews + view.name;
    try {
      context_.WriteOutput(view.image_file,
                           EncodeGrayFrame(LuminanceFromSrgb(reader->Read(frame))));
    } catch (const Error& e) {
      if (e.code() != ErrorCode::kDataLoss) throw;
      damaged_.push_back(view.name);
      return;
    }
    const double time_s = reader->times()[frame] + film.time_offset_s;
    times_.push_back({view.name, film.file, time_s, film.camera});
    views_.push_back(std::move(view));
  }

  StageContext& context_;
  int count_ = 0, done_ = 0;
  std::vector<View> views_;
  std::vector<FrameTime> times_;  // of views_
  std::vector<std::string> damaged_;
};

}  // namespace

bool ImportPosedFilms(const ImportOptions& options,
                      const FilmOptions& film,
                      StageContext& context) {
  const std::vector<Footage> all = AllFootage(film, context);
  if (all.empty()) return false;
  WarnOfUnusedOptions(film, NoFilm::kPosedFilms, context);
  size_t longest = 0;
  std::map<std::string, std::string> films;
  for (const Footage& footage : all) {
    longest = std::max(longest, footage.frames.size());
    films[footage.film.camera] = footage.film.file;
  }
  PosedFilmImport import(context);
  import.Read(all);
  const ImportResult result = import.Finish(options, longest);
  WriteImported(result, context, films);
  return true;
}

}  // namespace color3d
