#include "core/stage/film/colored_frames.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include "core/base/files.h"
#include "core/base/median.h"
#include "core/catalogue/scene_files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/stage/formats/artifacts.h"
#include "core/video/film_reader.h"
#include "core/video/mp4_writer.h"
#include "core/video/ticks.h"

namespace color3d {
namespace {

// When the movie shows each frame, and how long it does.
struct FrameTimes {
  int ticks_per_second = 0;
  std::vector<double> time_s;     // from the first one's
  std::vector<double> seconds;    // to the next one
  double frames_per_second = 25;  // as is usual
};

// Gaps that frames of no use have left stay gaps, so that what is heard fits what is seen.
FrameTimes TimesOf(const Scene& scene, const std::vector<int>& frames) {
  const auto time_s = [&](size_t i) { return scene.views[frames[i]].time_s(); };
  std::vector<double> steps;
  for (size_t i = 1; i < frames.size(); ++i) {
    const double step = time_s(i) - time_s(i - 1);
    if (step > 0.0) steps.push_back(step);
  }
  FrameTimes times;
  const double usual = steps.empty() ? 1.0 / times.frames_per_second : Median(std::move(steps));
  times.frames_per_second = std::clamp(1.0 / usual, 1.0, 120.0);
  for (size_t i = 0; i < frames.size(); ++i) {
    const double step = i > 0 ? time_s(i) - time_s(i - 1) : 0.0;
    // Another camera's film begins again.
    times.time_s.push_back(i == 0 ? 0.0 : times.time_s.back() + (step > 0.0 ? step : usual));
  }
  times.ticks_per_second = TicksPerSecond(times.time_s);
  for (size_t i = 1; i < times.time_s.size(); ++i) {
    // Broken films give two frames nearly one time.
    const double least = times.time_s[i - 1] + 1.0 / times.ticks_per_second;
    times.time_s[i] = std::max(times.time_s[i], least);
    times.seconds.push_back(times.time_s[i] - times.time_s[i - 1]);
  }
  times.seconds.push_back(usual);
  return times;
}

// None for frames that came as pictures, or from several cameras.
std::optional<SoundPart> SoundOf(const Scene& scene,
                                 const std::vector<int>& frames,
                                 const FrameTimes& times,
                                 const StageContext& context) {
  std::vector<std::string> films;
  for (const std::string& file : ListFiles(context.scene_folder())) {
    if (HasFilmExtension(file) && !IsAugmentFile(file)) films.push_back(file);
  }
  if (films.size() != 1) return std::nullopt;
  const std::filesystem::path film = context.scene_folder() / films[0];
  const FilmFacts facts = FilmReader(film).facts();
  if (!facts.has_sound) return std::nullopt;
  const double begin_s = facts.first_s + scene.views[frames.front()].time_s();
  return SoundPart{film, begin_s, begin_s + times.time_s.back() + times.seconds.back()};
}

// Movies have even sides.
Image EvenSides(const Image& image) {
  const int width = image.width - image.width % 2, height = image.height - image.height % 2;
  if (width == image.width && height == image.height) return image;
  Image out(width, height, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) out.At(c, y, x) = image.At(c, y, x);
    }
  }
  return out;
}

}  // namespace

Image ColoredFrame(const View& view,
                   int index,
                   bool is_key,
                   const ViewImages& images,
                   const StageContext& context) {
  const auto luminance = images.Luminance(index);
  return JoinLab(*luminance,
                 ReadTargetAb(context, view, is_key, luminance->width, luminance->height));
}

void WriteColoredFilm(const Scene& scene,
                      const std::vector<int>& frames,
                      const char* artifact,
                      StageContext& context,
                      const std::function<void(int view, const Image& srgb)>& written) {
  const ViewImages images(scene, context.scene_folder(), /*max_side_px=*/0, 0);
  const Camera camera = images.WorkingCamera(frames.front());
  const int key = context.HasInput(artifact::kKeyView) ? ReadKeyView(context, scene) : -1;
  const std::filesystem::path file = context.scratch_folder() / artifact;
  const FrameTimes times = TimesOf(scene, frames);
  Mp4Writer movie(file,
                  {.width = camera.width - camera.width % 2,
                   .height = camera.height - camera.height % 2,
                   .frames_per_second = times.frames_per_second,
                   .ticks_per_second = times.ticks_per_second,
                   .threads = context.pool().thread_count(),
                   .sound = SoundOf(scene, frames, times, context)});
  if (!movie.sound_warning().empty()) context.progress().OnWarning(movie.sound_warning());
  const auto count = static_cast<int>(frames.size());
  const int batch = context.pool().thread_count();
  std::vector<Image> pictures(batch);
  for (int begin = 0; begin < count; begin += batch) {
    context.cancel().ThrowIfCancelled();
    const int size = std::min(batch, count - begin);
    context.pool().ForEach(size, [&](int64_t i, int) {
      const int view = frames[begin + i];
      pictures[i] =
          SrgbFromLab(ColoredFrame(scene.views[view], view, view == key, images, context));
    });
    for (int i = 0; i < size; ++i) {
      const int frame = begin + i;
      movie.AddAt(
          times.time_s[frame], times.seconds[frame], EvenSides(pictures[i]), context.pool());
      if (written) written(frames[frame], pictures[i]);
    }
    context.progress().OnProgress(begin + size, count, "writing frames");
  }
  movie.Finish();
  context.TakeOutput(artifact, file);
}

void RenderFilm(const RenderOptions& options,
                const Scene& scene,
                const std::vector<int>& views,
                StageContext& context) {
  std::vector<int> frames(scene.views.size());
  std::iota(frames.begin(), frames.end(), 0);
  WriteColoredFilm(scene, frames, artifact::kMovie, context, [&](int view, const Image& srgb) {
    if (std::find(views.begin(), views.end(), view) == views.end()) return;
    context.WriteOutput(ViewArtifact(artifact::kRenders, scene.views[view], ".png"),
                        EncodePng8(FitWithin(srgb, options.max_side_px)));
  });
}

}  // namespace color3d
