#include "core/stage/movie/film_clock.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <string>
#include <utility>

#include "core/base/files.h"
#include "core/base/median.h"
#include "core/catalogue/scene_files.h"
#include "core/video/film_reader.h"
#include "core/video/ticks.h"

namespace color3d {
namespace {

constexpr double kLongestWhole = 1.0;  // longest span of times that may run from 0 to 1

// Path of the film relative to the folder of the scene; empty if there is none.
std::string FilmOf(const View& view, const StageContext& context) {
  if (!view.moment || !view.image_file.starts_with(artifact::kGivenViews)) return "";
  const std::optional<ImportFacts> facts = FindImportFacts(context);
  if (facts && !facts->cameras.empty()) {
    const auto shot = static_cast<size_t>(view.moment->shot);
    return shot < facts->cameras.size() ? facts->cameras[shot].film : "";
  }
  std::vector<std::string> films;
  for (const std::string& file : ListFiles(context.scene_folder())) {
    if (HasFilmExtension(file) && !IsAugmentFile(file)) films.push_back(file);
  }
  return films.size() == 1 ? films[0] : "";
}

// Index of a frame in its film, from its name ("f000012.png"); -1 for other names.
int FrameNumber(const View& view) {
  const std::string stem = std::filesystem::path(view.name).stem().string();
  int number = -1;
  if (stem.empty() || stem[0] != 'f') return -1;
  const auto [end, error] = std::from_chars(stem.data() + 1, stem.data() + stem.size(), number);
  return error == std::errc() && end == stem.data() + stem.size() ? number : -1;
}

}  // namespace

FilmClock ClockOf(const std::vector<double>& times_s) {
  std::vector<double> steps;
  for (size_t i = 1; i < times_s.size(); ++i) {
    const double step = times_s[i] - times_s[i - 1];
    if (step > 0.0) steps.push_back(step);
  }
  FilmClock clock;
  const double usual = steps.empty() ? 1.0 / clock.frames_per_second : Median(std::move(steps));
  clock.frames_per_second = std::clamp(1.0 / usual, 1.0, 120.0);
  for (size_t i = 0; i < times_s.size(); ++i) {
    const double step = i > 0 ? times_s[i] - times_s[i - 1] : 0.0;
    clock.time_s.push_back(i == 0 ? 0.0 : clock.time_s.back() + (step > 0.0 ? step : usual));
  }
  clock.ticks_per_second = TicksPerSecond(clock.time_s);
  for (size_t i = 1; i < clock.time_s.size(); ++i) {
    // Damaged films have frames with nearly equal times.
    const double least = clock.time_s[i - 1] + 1.0 / clock.ticks_per_second;
    clock.time_s[i] = std::max(clock.time_s[i], least);
    clock.seconds.push_back(clock.time_s[i] - clock.time_s[i - 1]);
  }
  clock.seconds.push_back(usual);
  return clock;
}

std::optional<ImportFacts> FindImportFacts(const StageContext& context) {
  if (!context.HasInput(artifact::kImportFacts)) return std::nullopt;
  return ImportFactsFromJson(context.ReadInput(artifact::kImportFacts));
}

bool TimesAreSeconds(const Scene& scene, const std::optional<ImportFacts>& facts) {
  if (facts && InfoOf(facts->layout).times_are_seconds) return true;
  return !scene.capture().is_reconstructed || scene.Times().back() > kLongestWhole;
}

std::optional<SoundPart> SoundFrom(const Scene& scene,
                                   int view,
                                   double begin_s,
                                   const FilmClock& clock,
                                   const StageContext& context) {
  const View& frame = scene.views[view];
  const std::string file = FilmOf(frame, context);
  const int number = FrameNumber(frame);
  if (file.empty() || number < 0) return std::nullopt;
  const std::filesystem::path path = context.scene_folder() / file;
  const FilmReader film(path, &context.cancel());
  if (!film.facts().has_sound || number >= static_cast<int>(film.times().size())) {
    return std::nullopt;
  }
  const double begin = film.facts().first_s + film.times()[number] + (begin_s - frame.time_s());
  return SoundPart{path, begin, begin + clock.time_s.back() + clock.seconds.back()};
}

}  // namespace color3d
