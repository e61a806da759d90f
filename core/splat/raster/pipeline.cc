#include "core/splat/raster/pipeline.h"

namespace color3d {

void SplatPipeline::Forward(const SplatInput& input,
                            const float* background,
                            bool depth_channel,
                            ThreadPool& pool,
                            const SplatDropping& dropping) {
  Enter(Phase::kProjection);
  ProjectSplats(input, depth_channel, pool, splats_);
  if (dropping.rate > 0.0) DropSplats(dropping, pool, splats_);
  const RasterCamera& camera = input.camera;
  Enter(Phase::kBinning);
  binner_.Bin(splats_, camera.width, camera.height, pool, lists_);
  Enter(Phase::kForward);
  color_.Reset(camera.width, camera.height, splats_.channels);
  transmittance_.Reset(camera.width, camera.height, 1);
  if (depth_channel) median_depth_.Reset(camera.width, camera.height, 1);
  float behind[4] = {0.0f, 0.0f, 0.0f, 0.0f};
  for (int c = 0; c < input.color.channels; ++c) behind[c] = background[c];
  RasterizeForward(splats_,
                   lists_,
                   behind,
                   pool,
                   {color_, &transmittance_, depth_channel ? &median_depth_ : nullptr},
                   block_masks_);
  Enter(Phase::kOther);
}

void SplatPipeline::Backward(const SplatInput& input,
                             const PlaneBuffer& d_color,
                             ThreadPool& pool,
                             const GradientOutput& output) {
  Enter(Phase::kBackward);
  RasterizeBackward(splats_, lists_, block_masks_, color_, d_color, pool, pair_gradient_);
  Enter(Phase::kProjectionBackward);
  ProjectSplatsBackward(input, splats_, pair_gradient_, lists_.first_pair, pool, output);
  Enter(Phase::kOther);
}

}  // namespace color3d
