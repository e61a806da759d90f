#include "core/stage/write_view_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/splat/export/export.h"
#include "core/splat/export/sog/sog.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/raster/render.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/movie/film_clock.h"
#include "core/stage/sources/focus.h"
#include "core/view/view_page.h"

namespace color3d {
namespace {

constexpr int kPosterPx = 900;              // longer side of the picture that is shown first
constexpr int kPhotoPx = 480;               // longer side of the photos
constexpr double kFramesPerSecond = 25.0;   // of scenes whose times are not seconds
constexpr size_t kLargeBytes = 25'000'000;  // of a page that plays
constexpr int kPhotoQuality = 80;           // of their JPEG
constexpr size_t kMaxPictures =
    48;  // photos with a picture; the others have a name and a camera only

// Adds the exported file and the confidence of its Gaussians in the same order.
void SetScene(const GaussianModel& model,
              const ExportFrame& frame,
              const ExportedFile& file,
              StageContext& context,
              ViewPage* page) {
  page->file_scale = frame.scale;
  page->file_offset = frame.offset;
  page->file_is_compressed = file.name == artifact::kSog;
  page->file_name = file.name;
  page->file_bytes = file.bytes;
  page->confidence = model.confidence;
  if (!page->file_is_compressed || model.confidence.empty()) return;
  const RgbHarmonics no_colors{.degree = 0, .sh = std::vector<float>(3 * model.size())};
  const std::vector<uint32_t> order =
      SogOrder(ForViewers(model, no_colors, frame, context.pool()).position);
  for (size_t i = 0; i < order.size(); ++i) page->confidence[i] = model.confidence[order[i]];
}

void SetPlayable(const PlayableScene& playable, const ExportFrame& frame, ViewPage* page) {
  page->file_scale = frame.scale;
  page->file_offset = frame.offset;
  page->file_is_compressed = true;
  page->file_name = artifact::kSog;
  page->file_bytes = playable.sog;
  page->confidence = playable.confidence;
  page->motion.emplace().file = playable.motion;
}

void SetTimes(const Scene& scene,
              int key_view,
              const StageContext& context,
              ViewPageMotion* motion) {
  const std::vector<double> times = scene.Times();
  motion->shown_s = scene.views[key_view].time_s();
  motion->steps = static_cast<int>(times.size());
  motion->times_are_known = TimesAreSeconds(scene, FindImportFacts(context));
  motion->seconds = motion->times_are_known ? times.back() - times.front()
                                            : static_cast<double>(times.size()) / kFramesPerSecond;
  motion->film = scene.FramesInShot(key_view);
}

// The photos; for dynamic scenes those of the time of the key view.
std::vector<ViewPagePhoto> PhotosOf(const Scene& scene,
                                    int key_view,
                                    bool moves,
                                    StageContext& context) {
  std::vector<ViewPagePhoto> photos;
  for (size_t i = 0; i < scene.views.size(); ++i) {
    if (moves && scene.views[i].time_s() != scene.views[key_view].time_s()) continue;
    photos.push_back({static_cast<int>(i), {}});
  }
  const size_t count = photos.size();
  std::vector<size_t> pictured;
  for (size_t i = 0; i < count; ++i) {
    const size_t evenly = i * kMaxPictures / count, next = (i + 1) * kMaxPictures / count;
    if (count <= kMaxPictures || next > evenly || photos[i].view == key_view) pictured.push_back(i);
  }
  const ViewImages images(scene, context.scene_folder(), kPhotoPx, 0);
  context.pool().ForEach(std::ssize(pictured), [&](int64_t i, int) {
    context.ThrowIfCancelled();
    ViewPagePhoto& photo = photos[pictured[i]];
    photo.jpeg = EncodeJpeg(images.Srgb(photo.view), kPhotoQuality);
  });
  return photos;
}

}  // namespace

bool WriteViewPage(const Scene& scene,
                   int key_view,
                   const GaussianModel& model,
                   bool moves,
                   ViewPageContents contents,
                   StageContext& context) {
  const auto& [file, playable, movie] = contents;
  if (file.name.empty()) return false;
  if (!HasViewer()) {
    context.Warn(
        "this build has no viewer, so {} is not written; build it where npm reaches its registry",
        artifact::kViewPage);
    return false;
  }
  const View& key = scene.views.at(key_view);
  const Camera camera = key.camera.FitWithin(kPosterPx);
  const RenderedView rendered = RenderView(model, camera, key.cam_from_world, context.pool());

  ViewPage page;
  if (playable == nullptr) {
    SetScene(model, ExportFrameOf(scene), file, context, &page);
  } else {
    SetPlayable(*playable, ExportFrameOf(scene), &page);
    SetTimes(scene, key_view, context, &*page.motion);
  }
  page.key_view = key_view;
  page.focus = FocusOf(key, camera, rendered.median_depth);
  page.poster = EncodeJpeg(SrgbFromLab(rendered.lab, context.pool()), kPhotoQuality);
  page.photos = PhotosOf(scene, key_view, moves, context);
  page.movie = {movie.bytes, movie.has_sound, movie.shows_motion};
  const std::string html = RenderViewPage(scene, page);
  if (playable != nullptr && html.size() > kLargeBytes) {
    context.Warn("{} has {} MB; fewer Gaussians (max_gaussians) make it smaller",
                 artifact::kViewPage,
                 html.size() / 1'000'000);
  }
  context.WriteOutput(artifact::kViewPage, html);
  return true;
}

}  // namespace color3d
