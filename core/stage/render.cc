
#include <algorithm>

#include "core/base/error.h"
#include "core/base/evenly.h"
#include "core/base/range_check.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/stage/coloring/colored_photos.h"
#include "core/stage/film/film_writer.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/movie/movie.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/render_view.h"

namespace color3d {
namespace {

std::vector<int> ViewsToRender(const RenderOptions& options, const Scene& scene) {
  std::vector<int> views;
  for (const std::string& name : options.views) views.push_back(scene.FindView(name));
  if (!views.empty()) return views;
  views = scene.HeldOutViews();
  if (views.empty()) {
    for (size_t i = 0; i < scene.views.size(); ++i) views.push_back(static_cast<int>(i));
  }
  return PickEvenly(std::move(views), static_cast<size_t>(options.max_views));
}

// False for a model that came without the colours of the frames.
bool HasColors(const StageContext& context, const Scene& scene) {
  return context.HasInput(artifact::kKeyView) && context.HasInput(artifact::kKeyColor) &&
         context.HasInput(ViewAbArtifact(context, scene.views.front()));
}

// Films without poses cannot be rendered along a camera path: they have no geometry.
void CheckPathOfFilm(const RenderOptions& options) {
  if (options.path == RenderOptions::Path::kViews && !options.time_s) return;
  throw InvalidArgument(
      "this film has no poses, so no camera can move through it; its coloured frames are {} of the "
      "job that coloured it. For a scene to move through, colour a film of one moving camera with "
      "poses (film_poses: auto)",
      artifact::kMovie);
}

}  // namespace

void RenderOptions::Validate() const {
  const RangeCheck check("render option");
  check("max_views", max_views, 1, 1000);
  CheckMaxSide(max_side_px);
  if (frames) check("frames", *frames, 1, kMaxMovieFrames);
  check("frames_per_second", frames_per_second, 1, 120);
  if (time_s) check("time_s", *time_s, 0, 86400);
  if (path != Path::kViews && !video && !pictures) {
    throw InvalidArgument(
        "a path without video and without pictures writes nothing; ask for one of them");
  }
  if ((path == Path::kCameras) != !cameras.empty()) {
    throw InvalidArgument(
        cameras.empty() ? "the path by cameras needs a file of cameras"
                        : "the file of cameras is used by the path by cameras only; leave it out");
  }
}

void RunRender(const RenderOptions& options, StageContext& context) {
  options.Validate();
  const Scene scene = ReadScene(context);
  if (scene.are_pictures) {
    CheckPathOfFilm(options);
    return WriteColoredPhotos(options, scene, ViewsToRender(options, scene), context);
  }
  if (!ColoredAs(context, scene).is_reconstructed) {
    CheckPathOfFilm(options);
    return RenderFilm(options, scene, ViewsToRender(options, scene), context);
  }
  WriteUnplacedPhotos(scene, context);
  const GaussianModel model = ParseGaussians(context.ReadInput(artifact::kModel));
  if (model.size() == 0)
    throw InvalidArgument("the model has no Gaussians: there is nothing to render");
  if (options.path != RenderOptions::Path::kViews) {
    return RenderMovie(options, scene, model, context);
  }
  const std::vector<int> views = ViewsToRender(options, scene);
  if (model.IsDynamic()) {  // seen by the camera of the key view
    RenderOptions movie = options;
    movie.views.clear();
    movie.path = RenderOptions::Path::kPhotos;
    movie.pictures = false;  // `pictures` means those of the films of the cameras
    RenderMovie(movie, scene, model, context);
  }
  if (scene.HasTimes()) {  // moving or static
    if (HasColors(context, scene)) WriteFilmsOfCameras(scene, options.pictures, context);
  } else if (options.pictures) {
    context.Warn(
        "pictures is ignored: it is for the frames of films and of dynamic scenes, and these are "
        "photos");
  }
  for (size_t i = 0; i < views.size(); ++i) {
    context.ThrowIfCancelled();
    const View& view = scene.views[views[i]];
    const RenderedView rendered =
        RenderView(model, view, view.camera.FitWithin(options.max_side_px), context.pool());
    context.WriteOutput(ViewArtifact(artifact::kRenders, view),
                        EncodePng8(SrgbFromLab(rendered.lab, context.pool())));
    context.ReportProgress(
        static_cast<int64_t>(i) + 1, std::ssize(views), "rendering " + view.name);
  }
}

}  // namespace color3d
