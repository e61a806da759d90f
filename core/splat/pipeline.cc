#include "core/splat/pipeline.h"

namespace color3d {

void SplatPipeline::Forward(const ParameterBlock& parameters,
                            const ColorSpec& color,
                            const RasterCamera& camera,
                            const float* background,
                            bool depth_channel,
                            ThreadPool& pool) {
  ProjectSplats(parameters, color, depth_channel, camera, pool, splats_);
  binner_.Bin(splats_, camera.width, camera.height, pool, lists_);
  color_.Reset(camera.width, camera.height, splats_.channels);
  transmittance_.Reset(camera.width, camera.height, 1);
  float behind[4] = {0.0f, 0.0f, 0.0f, 0.0f};
  for (int c = 0; c < color.channels; ++c) behind[c] = background[c];
  RasterizeForward(splats_, lists_, behind, pool, color_, &transmittance_, block_masks_);
}

void SplatPipeline::Backward(const ParameterBlock& parameters,
                             const ColorSpec& color,
                             const RasterCamera& camera,
                             const PlaneBuffer& d_color,
                             GradientScope scope,
                             ThreadPool& pool,
                             ParameterBlock& gradient,
                             DensifyStatistics* statistics) {
  const bool absolute = statistics != nullptr && statistics->absolute;
  RasterizeBackward(splats_, lists_, block_masks_, color_, d_color, absolute, pool, pair_gradient_);
  ProjectSplatsBackward(parameters,
                        color,
                        camera,
                        splats_,
                        pair_gradient_,
                        lists_.first_pair,
                        scope,
                        pool,
                        gradient,
                        statistics);
}

}  // namespace color3d
