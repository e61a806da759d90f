#include "core/splat/raster/render.h"

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
  const ColorSpec color = ColorSpecOf(model.channels, model.sh_degree, model.chroma_sh_degree);
  const RasterCamera raster_camera = MakeRasterCamera(camera, cam_from_world);
  const float background[3] = {background_l, kNeutralChroma, kNeutralChroma};
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
      const float scale = c == 0 ? 100.0f : 255.0f, offset = c == 0 ? 0.0f : -128.0f;
      for (int x = 0; x < camera.width; ++x) view.lab.At(c, y, x) = scale * value[x] + offset;
    }
  }
  return view;
}

}  // namespace color3d
