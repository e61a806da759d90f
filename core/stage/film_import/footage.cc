#include "core/stage/film_import/footage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "core/base/error.h"
#include "core/image/codec.h"
#include "core/scene/frame_times.h"
#include "core/stage/film_import/film_frames.h"
#include "core/video/film_reader.h"
#include "core/video/sound_offset.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr double kNoTime = -std::numeric_limits<double>::infinity();

constexpr char kOffsetsFile[] = "transforms.json";  // may give the time offset of each film

// Contents of a film file.
struct IndexedFilm {
  FilmFacts facts;
  std::vector<double> times;
};
using IndexedFilms = std::map<std::string, IndexedFilm>;  // by file

// Sound levels of the first ten minutes of a film; empty if it is not to be aligned by sound.
std::vector<float> SoundLevelsOf(const Footage& footage,
                                 const IndexedFilms& films,
                                 const StageContext& context) {
  constexpr double kMostS = 600.0;
  if (footage.film.is_pictures || footage.film.has_pose) return {};
  const FilmFacts& facts = films.at(footage.film.file).facts;
  if (!facts.has_sound) return {};
  return SoundLevels({context.scene_folder() / footage.film.file,
                      facts.first_s,
                      facts.first_s + std::min(kMostS, facts.seconds)},
                     context.cancel());
}

// Shifts films to the clock of the first one with sound, by the sound that both recorded. Films
// without sound in common keep their time.
void AlignBySound(const IndexedFilms& films, std::vector<Footage>* all, StageContext& context) {
  const Footage* first = nullptr;
  std::vector<float> heard;
  for (Footage& footage : *all) {
    std::vector<float> levels = SoundLevelsOf(footage, films, context);
    if (levels.empty()) continue;
    if (first == nullptr) {
      first = &footage;
      heard = std::move(levels);
      continue;
    }
    const std::optional<double> offset_s = SoundOffset(heard, levels);
    if (!offset_s) {
      context.Warn(
          "{} and {} have no sound in common to align them by, and are assumed to begin together; "
          "otherwise give time_offset in transforms.json",
          first->film.file,
          footage.film.file);
      continue;
    }
    const double interval_s = footage.times.size() < 2 ? 0.0 : footage.times[1] - footage.times[0];
    if (std::abs(*offset_s) < 0.5 * interval_s) continue;
    for (double& time_s : footage.times) time_s += *offset_s;
    context.Warn("by their sound, {} began {:.2f} s {} {}",
                 footage.film.file,
                 std::abs(*offset_s),
                 *offset_s > 0.0 ? "after" : "before",
                 first->film.file);
  }
}

// The films with the times of their frames on the common clock.
std::vector<Footage> FilmsInTime(const FilmOptions& options, StageContext& context) {
  IndexedFilms films;
  const auto size_of = [&](const std::string& file) {
    context.ThrowIfCancelled();
    const FilmReader reader(context.scene_folder() / file, &context.cancel());
    const FilmFacts& facts = reader.facts();
    CheckMovieSize(file, facts.width, facts.height);
    films[file] = {facts, reader.times()};
    return std::pair(facts.width, facts.height);
  };
  std::vector<Footage> all;
  for (CameraFilm& film : ReadCameraFilms(context.scene_folder(), size_of)) {
    Footage footage{std::move(film), {}, {}, {}};
    if (footage.film.is_pictures) {
      footage.pictures = PicturesIn(context.scene_folder() / footage.film.file);
      footage.times = TimesOfPictures(footage.pictures, options, context);
    } else {
      if (!films.contains(footage.film.file)) size_of(footage.film.file);
      footage.times = films.at(footage.film.file).times;
    }
    for (double& time_s : footage.times) time_s += footage.film.time_offset_s;
    all.push_back(std::move(footage));
  }
  if (!fs::exists(context.scene_folder() / kOffsetsFile)) AlignBySound(films, &all, context);
  double begin_s = std::numeric_limits<double>::infinity();
  for (const Footage& footage : all) begin_s = std::min(begin_s, footage.times.front());
  for (Footage& footage : all) {
    for (double& time_s : footage.times) time_s -= begin_s;
  }
  return all;
}

// Returns true for times in the requested part, extended by `margin_s` to either side.
bool IsInside(double time_s, const FilmOptions& options, double margin_s) {
  return time_s >= options.begin_s - margin_s &&
         (!options.end_s || time_s < *options.end_s + margin_s);
}

// Sets the times of frames that repeat the time of the one before them to kNoTime.
void DropRepeatedFrames(std::vector<Footage>* all) {
  // Relative to the time from first to last; AssignMoments treats smaller distances as one time.
  constexpr double kApart = 2e-6;
  double first_s = std::numeric_limits<double>::infinity(), last_s = 0.0;
  for (const Footage& footage : *all) {
    first_s = std::min(first_s, footage.times.front());
    last_s = std::max(last_s, footage.times.back());
  }
  for (Footage& footage : *all) {
    double before_s = kNoTime;
    for (double& time_s : footage.times) {
      if (time_s - before_s <= kApart * (last_s - first_s)) {
        time_s = kNoTime;
      } else {
        before_s = time_s;
      }
    }
  }
}

// Gives frames of different films that were taken together one time, near the requested part.
// Returns true if the films follow one clock, so that there are such frames.
bool AlignTimes(const FilmOptions& options, std::vector<Footage>* all, StageContext& context) {
  constexpr double kMarginS = 1.0;  // longer than a frame; the films may be hours longer
  std::vector<FrameTime> frames;
  std::vector<double*> times;
  for (Footage& footage : *all) {
    for (double& time_s : footage.times) {
      if (!IsInside(time_s, options, kMarginS)) continue;
      frames.push_back({footage.film.file, footage.film.file, time_s, footage.film.camera});
      times.push_back(&time_s);
    }
  }
  const FrameMoments moments = AssignMoments(frames);
  if (moments.cameras.empty()) return true;  // no frames, or all at one time
  if (!moments.note.empty()) context.Warn(moments.note);
  double begin_s = std::numeric_limits<double>::infinity();
  for (const FrameTime& frame : frames) begin_s = std::min(begin_s, *frame.time);
  for (size_t i = 0; i < times.size(); ++i) *times[i] = begin_s + moments.moments[i]->time_s;
  return moments.one_clock;
}

// Selects every stride-th time of the requested part in all films. Without a common clock, selects
// every stride-th frame of each film.
void SelectFrames(const FilmOptions& options, std::vector<Footage>* all, StageContext& context) {
  constexpr double kRoundedS = 1e-6;             // rounding error of adding an offset
  std::vector<std::pair<double, double>> spans;  // of each film, for errors
  for (const Footage& footage : *all) {
    spans.emplace_back(footage.times.front(), footage.times.back());
  }
  DropRepeatedFrames(all);
  const bool one_clock = AlignTimes(options, all, context);
  std::map<double, int> moments;  // times of that part, with their numbers
  for (const Footage& footage : *all) {
    for (const double time_s : footage.times) {
      if (IsInside(time_s + kRoundedS, options, 0.0)) moments[time_s] = 0;
    }
  }
  int count = 0;
  for (auto& [time_s, number] : moments) number = count++;
  for (size_t film = 0; film < all->size(); ++film) {
    Footage& footage = (*all)[film];
    int own = 0;
    for (size_t i = 0; i < footage.times.size(); ++i) {
      const auto moment = moments.find(footage.times[i]);
      if (moment == moments.end()) continue;
      const int number = one_clock ? moment->second : own++;
      if (number % options.stride == 0) footage.frames.push_back(static_cast<int>(i));
    }
    if (!footage.frames.empty()) continue;
    throw InvalidArgument(
        "{}: the film has no frame in the requested part (film_begin_s, film_end_s, film_stride); "
        "it runs from {:.2f} to {:.2f} s on the common clock",
        footage.film.file,
        spans[film].first,
        spans[film].second);
  }
}

}  // namespace

std::vector<Footage> ReadFootage(const FilmOptions& options, StageContext& context) {
  std::vector<Footage> all = FilmsInTime(options, context);
  if (all.empty()) return all;
  SelectFrames(options, &all, context);
  size_t frames = 0;
  double seconds = 0.0;
  for (const Footage& footage : all) {
    frames += footage.frames.size();
    seconds = std::max(
        seconds, footage.times[footage.frames.back()] - footage.times[footage.frames.front()]);
  }
  CheckFrameCount(frames, seconds, options);
  return all;
}

FootageReader::FootageReader(const Footage& footage, const StageContext& context)
    : footage_(footage), file_(context.scene_folder() / footage.film.file) {
  if (!footage.film.is_pictures) video_ = std::make_unique<FilmReader>(file_, &context.cancel());
}

FootageReader::~FootageReader() = default;

bool FootageReader::interlaced() const { return video_ && video_->facts().interlaced; }

std::vector<std::string> FootageReader::notes() const {
  return video_ ? video_->facts().notes : std::vector<std::string>();
}

std::string FootageReader::NameOf(int frame) const {
  return video_ ? fmt::format("f{:06}.png", frame) : footage_.pictures[frame];
}

Image FootageReader::Read(int frame) {
  return video_ ? video_->Read(frame) : ReadImage(file_ / footage_.pictures[frame]);
}

}  // namespace color3d
