#include "tests/bench/training_scores.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/metrics/view_scores.h"
#include "core/scene/view_images.h"
#include "core/splat/raster/render.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {

nlohmann::ordered_json ScoreTrainingViews(StageContext& context) {
  const Scene scene = ReadScene(context);
  const int key = ReadKeyView(context, scene);
  const GaussianModel model = ParseGaussians(context.ReadInput(artifact::kModel));
  const ViewImages images(scene,
                          context.scene_folder(),
                          ColoredSide(context, scene.views[key]),
                          /*cache_budget_bytes=*/0);
  Scores sum;
  SourceErrors photos, renders;
  double views = 0.0;
  for (int view : scene.TrainingViews()) {
    if (view == key) continue;
    const Image truth =
        images.Undistort(view, ReadImage(context.scene_folder() / scene.views[view].image_file));
    const Camera camera = images.WorkingCamera(view);
    const Image ab = ReadViewAb(context, scene.views[view], camera.width, camera.height);
    const auto mask = images.Mask(view);
    const Image lab = RenderView(model,
                                 camera,
                                 scene.views[view].cam_from_world,
                                 context.pool(),
                                 0.0f,
                                 scene.views[view].time_s())
                          .lab;
    const Scores of_view = ScoreView(truth, lab, ab, mask.get());
    if (of_view.empty()) continue;
    for (const auto& [name, value] : of_view) sum[name] += value;
    const std::string name = ViewArtifact(artifact::kProvenance, scene.views[view], ".png");
    if (context.HasInput(name)) {
      const Image shares = DecodeImage(context.ReadInput(name), name);
      photos.Add(truth, ab, shares, mask.get());
      renders.Add(truth, ChromaOfLab(lab), shares, mask.get());
    }
    views += 1.0;
  }
  nlohmann::ordered_json scores;
  for (const auto& [name, value] : sum) scores[name] = value / std::max(views, 1.0);
  for (const auto& [name, value] : photos.Result()) scores[name] = value;
  for (const auto& [name, value] : renders.Result()) {
    if (name.starts_with("delta")) scores["rendered_" + name] = value;
  }
  return scores;
}

}  // namespace color3d
