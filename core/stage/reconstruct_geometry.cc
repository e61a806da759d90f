#include <algorithm>

#include "core/scene/view_images.h"
#include "core/stage/artifacts.h"
#include "core/stage/stages.h"

namespace color3d {
namespace {

// More Gaussians than this share of the training pixels cost time and fit noise: small scenes get a
// smaller cap than asked for.
constexpr double kMaxGaussiansPerPixel = 0.02;
constexpr int kFewestGaussians = 5000;

int GaussianCap(int wanted, const Scene& scene, const ViewImages& images) {
  double pixels = 0.0;
  for (int view : scene.TrainingViews()) {
    const Camera camera = images.WorkingCamera(view);
    pixels += static_cast<double>(camera.width) * camera.height;
  }
  const double cap = std::max<double>(kFewestGaussians, kMaxGaussiansPerPixel * pixels);
  return static_cast<int>(std::min<double>(wanted, cap));
}

}  // namespace

void RunReconstructGeometry(const GeometryOptions& options,
                            int max_side_px,
                            StageContext& context) {
  options.Validate();
  CheckMaxSide(max_side_px);
  const Scene scene = ReadScene(context);
  const ViewImages images(scene, context.scene_folder(), max_side_px);
  GeometryOptions capped = options;
  capped.max_gaussians = GaussianCap(options.max_gaussians, scene, images);
  ThreadPool pool(context.threads());
  const GaussianModel model = TrainGeometry(
      scene, images, capped, pool, context.checkpoints(), context.progress(), context.cancel());
  context.WriteOutput(artifact::kGeometry, SerializeGaussians(model));
}

}  // namespace color3d
