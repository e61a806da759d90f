#include "core/stage/film/colored_frames.h"

#include <algorithm>
#include <optional>

#include "core/base/median.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/stage/formats/artifacts.h"
#include "core/video/mp4_writer.h"

namespace color3d {
namespace {

constexpr double kUnknownFramesPerSecond = 25.0;

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

double FilmFramesPerSecond(const Scene& scene) {
  std::vector<double> steps;
  for (size_t i = 1; i < scene.views.size(); ++i) {
    steps.push_back(scene.views[i].moment->time_s - scene.views[i - 1].moment->time_s);
  }
  if (steps.empty()) return kUnknownFramesPerSecond;
  const double step = Median(std::move(steps));
  return step > 0.0 ? std::clamp(1.0 / step, 1.0, 120.0) : kUnknownFramesPerSecond;
}

void RenderFilm(const RenderOptions& options,
                const Scene& scene,
                const std::vector<int>& views,
                StageContext& context) {
  const ViewImages images(scene, context.scene_folder(), /*max_side_px=*/0, 0);
  const Camera camera = images.WorkingCamera(0);
  const int key = context.HasInput(artifact::kKeyView) ? ReadKeyView(context, scene) : -1;
  const std::filesystem::path file = context.scratch_folder() / artifact::kMovie;
  Mp4Writer movie(file,
                  {.width = camera.width - camera.width % 2,
                   .height = camera.height - camera.height % 2,
                   .frames_per_second = FilmFramesPerSecond(scene),
                   .threads = context.pool().thread_count()});
  const auto count = static_cast<int>(scene.views.size());
  const int batch = context.pool().thread_count();
  std::vector<Image> frames(batch);
  for (int begin = 0; begin < count; begin += batch) {
    context.cancel().ThrowIfCancelled();
    const int size = std::min(batch, count - begin);
    context.pool().ForEach(size, [&](int64_t i, int) {
      const int view = begin + static_cast<int>(i);
      frames[i] = SrgbFromLab(ColoredFrame(scene.views[view], view, view == key, images, context));
    });
    for (int i = 0; i < size; ++i) {
      const int view = begin + i;
      movie.Add(EvenSides(frames[i]), context.pool());
      if (std::find(views.begin(), views.end(), view) == views.end()) continue;
      context.WriteOutput(ViewArtifact(artifact::kRenders, scene.views[view], ".png"),
                          EncodePng8(FitWithin(frames[i], options.max_side_px)));
    }
    context.progress().OnProgress(begin + size, count, "writing frames");
  }
  movie.Finish();
  context.TakeOutput(artifact::kMovie, file);
}

}  // namespace color3d
