#include "core/splat/raster/render.h"

#include <algorithm>

#include "core/color/lab.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/motion/geometry_in_time.h"
#include "core/splat/raster/pipeline.h"
#include "core/splat/raster/raster_camera.h"
#include "core/splat/raster/raster_constants.h"

namespace color3d {

RenderedView RenderView(const GaussianModel& model,
                        const Camera& camera,
                        const Pose& cam_from_world,
                        ThreadPool& pool,
                        float background_l,
                        double time_s) {
  const ParameterBlock parameters = ParametersAt(model, time_s, pool);
  const ColorSpec color = LayoutOf(model).Spec();
  const RasterCamera raster_camera = MakeRasterCamera(camera, cam_from_world);
  const bool srgb = model.color_space == ColorSpace::kSrgb;
  float background[3] = {background_l, kNeutralChroma, kNeutralChroma};
  if (srgb) {
    const RgbColor gray = SrgbFromLab(LabColor{100.0 * background_l, 0.0, 0.0});
    std::fill_n(background, 3, static_cast<float>(gray.g));
  }
  SplatPipeline pipeline;
  pipeline.Forward({parameters, color, raster_camera}, background, true, pool);
  RenderedView view;
  view.lab = Image(camera.width, camera.height, model.channels);
  view.depth = Image(camera.width, camera.height, 1);
  view.median_depth = Image(camera.width, camera.height, 1);
  view.opacity = Image(camera.width, camera.height, 1);
  for (int y = 0; y < camera.height; ++y) {
    const float* transmittance = pipeline.transmittance().Row(0, y);
    const float* median = pipeline.median_depth().Row(0, y);
    const float* depth = pipeline.color().Row(model.channels, y);
    for (int x = 0; x < camera.width; ++x) {
      const float opacity = 1.0f - transmittance[x];
      view.opacity.At(0, y, x) = opacity;
      view.median_depth.At(0, y, x) = median[x];
      view.depth.At(0, y, x) = opacity > kMinTransmittance ? depth[x] / opacity : 0.0f;
    }
    for (int c = 0; c < model.channels; ++c) {
      const float* value = pipeline.color().Row(c, y);
      if (srgb) {
        for (int x = 0; x < camera.width; ++x) {
          view.lab.At(c, y, x) = std::clamp(value[x], 0.0f, 1.0f);
        }
        continue;
      }
      const float scale = c == 0 ? 100.0f : 255.0f, offset = c == 0 ? 0.0f : -128.0f;
      for (int x = 0; x < camera.width; ++x) view.lab.At(c, y, x) = scale * value[x] + offset;
    }
  }
  if (srgb) view.lab = LabFromSrgb(view.lab);
  return view;
}

}  // namespace color3d
