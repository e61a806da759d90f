#include "core/stage/film/film_writer.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "core/catalogue/film_rate.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/stage/film/frames_of_views.h"
#include "core/stage/film_import/film_frames.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/movie/film_clock.h"
#include "core/video/mp4_writer.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Fits the picture into a movie frame, cropped to MovieSize.
Image MovieFrame(const Image& picture) {
  Image image = FitWithin(picture, kMaxMovieSidePx);
  const auto [width, height] = MovieSize(picture.width, picture.height);
  if (width == image.width && height == image.height) return image;
  Image out(width, height, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) out.At(c, y, x) = image.At(c, y, x);
    }
  }
  return out;
}

FilmClock ClockOfFilm(const Scene& scene,
                      const std::vector<int>& frames,
                      const StageContext& context) {
  const bool seconds = TimesAreSeconds(scene, FindImportFacts(context));
  std::vector<double> times;
  for (size_t i = 0; i < frames.size(); ++i) {
    times.push_back(seconds ? scene.views[frames[i]].time_s()
                            : static_cast<double>(i) / kDefaultFramesPerSecond);
  }
  return ClockOf(times);
}

// A file name for the camera that is not among `taken`.
std::string FileNameOf(const std::string& camera, std::set<std::string>* taken) {
  std::string name = camera.empty() ? "camera" : camera;
  for (char& c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80 && std::isalnum(byte) == 0 && c != '-' && c != '.') c = '_';
  }
  if (name[0] == '.') name[0] = '_';
  std::string unlike = name;
  for (int i = 2; !taken->insert(unlike).second; ++i) unlike = name + "_" + std::to_string(i);
  return unlike;
}

// Publishes the file of the scratch folder under each of the names.
void PublishAs(const std::vector<std::string>& artifacts,
               const fs::path& file,
               StageContext& context) {
  for (size_t i = 1; i < artifacts.size(); ++i) {
    const fs::path copy = file.string() + ".copy";
    fs::copy_file(file, copy);
    context.MoveOutput(artifacts[i], copy);
  }
  context.MoveOutput(artifacts[0], file);
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
                      const ColoredFilm& film,
                      StageContext& context,
                      const std::function<void(int view, const Image& srgb)>& written) {
  const std::vector<int>& frames = film.frames;
  const ViewImages images(scene, context.scene_folder(), /*max_side_px=*/0, 0);
  const Camera camera = images.WorkingCamera(frames.front());
  const auto [width, height] = MovieSize(camera.width, camera.height);
  const int key = context.HasInput(artifact::kKeyView) ? ReadKeyView(context, scene) : -1;
  const fs::path file = context.scratch_folder() / "colored_film.mp4";
  const FilmClock clock = ClockOfFilm(scene, frames, context);
  Mp4Writer movie(file,
                  {.width = width,
                   .height = height,
                   .frames_per_second = clock.frames_per_second,
                   .ticks_per_second = clock.ticks_per_second,
                   .sound = SoundFrom(
                       scene, frames.front(), scene.views[frames.front()].time_s(), clock, context),
                   .cancel = &context.cancel()});
  if (!movie.sound_warning().empty()) context.Warn(movie.sound_warning());
  const auto count = static_cast<int>(frames.size());
  const int batch = context.pool().thread_count();
  std::vector<Image> pictures(batch);
  std::vector<std::string> files(batch);
  for (int begin = 0; begin < count; begin += batch) {
    context.ThrowIfCancelled();
    const int size = std::min(batch, count - begin);
    context.pool().ForEach(size, [&](int64_t i, int) {
      const int view = frames[begin + i];
      pictures[i] =
          SrgbFromLab(ColoredFrame(scene.views[view], view, view == key, images, context));
      if (film.pictures) files[i] = EncodePng8(pictures[i]);
    });
    for (int i = 0; i < size; ++i) {
      const int frame = begin + i;
      const View& view = scene.views[frames[frame]];
      movie.AddAt(
          clock.time_s[frame], clock.seconds[frame], MovieFrame(pictures[i]), context.pool());
      if (film.pictures) {
        context.WriteOutput(ViewArtifact(artifact::kFilmFrames, view), files[i]);
      }
      if (written) written(frames[frame], pictures[i]);
    }
    context.ReportProgress(begin + size, count, "writing frames of " + film.artifacts[0]);
  }
  movie.Finish();
  PublishAs(film.artifacts, file, context);
}

void WriteFilmsOfCameras(const Scene& scene, bool pictures, StageContext& context) {
  const int key = ReadKeyView(context, scene);
  const std::optional<ImportFacts> facts = FindImportFacts(context);
  if (!facts || facts->cameras.size() < 2) {
    return WriteColoredFilm(scene, {scene.FramesInShot(key), {artifact::kFilm}, pictures}, context);
  }
  std::set<std::string> taken;
  for (auto& [shot, frames] : FramesByShot(scene)) {
    const std::string camera = facts->cameras.at(static_cast<size_t>(shot)).name;
    ColoredFilm film{std::move(frames), {}, pictures};
    film.artifacts.push_back(artifact::kFilms + FileNameOf(camera, &taken) + ".mp4");
    if (shot == scene.views[key].moment->shot) film.artifacts.emplace_back(artifact::kFilm);
    WriteColoredFilm(scene, film, context);
  }
}

void RenderFilm(const RenderOptions& options,
                const Scene& scene,
                const std::vector<int>& views,
                StageContext& context) {
  ColoredFilm film{{}, {artifact::kMovie}, options.pictures};
  film.frames.resize(scene.views.size());
  std::iota(film.frames.begin(), film.frames.end(), 0);
  WriteColoredFilm(scene, film, context, [&](int view, const Image& srgb) {
    if (std::ranges::find(views, view) == views.end()) return;
    context.WriteOutput(ViewArtifact(artifact::kRenders, scene.views[view]),
                        EncodePng8(FitWithin(srgb, options.max_side_px)));
  });
}

}  // namespace color3d
