#include "core/stage/report/report_views.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/evenly.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/sources/render_view.h"

namespace color3d {
namespace {

constexpr size_t kMaxViews = 50;
constexpr int kLargestPx = 800, kSmallestPx = 440;  // longer side
constexpr double kViewsAtLargest =
    12.0;  // number of views; with more, pictures shrink so that their total size stays the same
constexpr int kQuality = 82;

bool HasRender(const View& view, const StageContext& context) {
  return context.HasInput(ViewArtifact(artifact::kRenders, view));
}

std::vector<int> ChosenViews(const Scene& scene, bool has_model, const StageContext& context) {
  std::vector<int> held_out, training;
  for (size_t i = 0; i < scene.views.size(); ++i) {
    if (!has_model && !HasRender(scene.views[i], context)) continue;
    (scene.views[i].held_out ? held_out : training).push_back(static_cast<int>(i));
  }
  std::vector<int> chosen = PickEvenly(held_out, kMaxViews / 2);
  const std::vector<int> others = PickEvenly(training, kMaxViews - chosen.size());
  chosen.insert(chosen.end(), others.begin(), others.end());
  return chosen;
}

ReportView::Picture PictureOf(const char* role,
                              const char* short_name,
                              const char* caption,
                              const Image& image) {
  return {role, short_name, caption, EncodeJpeg(image, kQuality), image.width, image.height};
}

Image GrayPicture(const Image& luminance) {
  return SrgbFromLab(JoinLab(luminance, Image(luminance.width, luminance.height, 2, 0.0f)));
}

}  // namespace

std::vector<ReportView> ReportViews(const Scene& scene, StageContext& context) {
  std::optional<GaussianModel> model;
  if (context.HasInput(artifact::kModel)) {
    model = ParseGaussians(context.ReadInput(artifact::kModel));
    if (model->channels != 3 || model->size() == 0) model.reset();
  }
  const std::vector<int> chosen = ChosenViews(scene, model.has_value(), context);
  const double side = kLargestPx * std::sqrt(kViewsAtLargest / std::max<size_t>(1, chosen.size()));
  const int side_px = std::clamp(static_cast<int>(side), kSmallestPx, kLargestPx);
  const ViewImages photos(scene, context.scene_folder(), side_px, 0);
  // Renders one view at a time with all threads; the other pictures are made by one thread each.
  std::vector<Image> renders(chosen.size());
  for (size_t i = 0; model && i < chosen.size(); ++i) {
    context.ThrowIfCancelled();
    const View& view = scene.views[chosen[i]];
    renders[i] = RenderView(*model, view, photos.WorkingCamera(chosen[i]), context.pool()).lab;
  }
  std::vector<ReportView> views(chosen.size());
  context.pool().ForEach(std::ssize(chosen), [&](int64_t i, int) {
    context.ThrowIfCancelled();
    const View& view = scene.views[chosen[i]];
    const auto artifact_of = [&](const char* folder, const char* extension) {
      const std::string name = ViewArtifact(folder, view, extension);
      if (!context.HasInput(name)) return Image();
      return FitWithin(ReadPicture(context, name), side_px);
    };
    ReportView& shown = views[i];
    shown.name = view.name + (view.held_out ? " (held out)" : "");
    shown.pictures.push_back(PictureOf(
        "gray", "photo", "the monochrome photo", GrayPicture(*photos.Luminance(chosen[i]))));
    const Image render = model ? SrgbFromLab(renders[i]) : artifact_of(artifact::kRenders, ".png");
    renders[i] = {};
    shown.pictures.push_back(
        PictureOf("render", "coloured scene", "rendered from the coloured 3D scene", render));
    if (const Image truth = artifact_of(artifact::kTruths, ".jpg"); !truth.Empty()) {
      shown.pictures.push_back(PictureOf("truth", "true colours", "the true colours", truth));
    }
    if (const Image direct = artifact_of(artifact::kColored2d, ".jpg"); !direct.Empty()) {
      shown.pictures.push_back(
          PictureOf("direct", "colorizer alone", "the colorizer on the monochrome photo", direct));
    }
  });
  return views;
}

}  // namespace color3d
