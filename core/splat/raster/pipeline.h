// Forward and backward pass of one picture, with buffers reused between pictures. Internal to the
// splat module. Not thread-safe; uses the pool's threads.
#pragma once

#include <vector>

#include "core/base/parallel.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/raster/binning.h"
#include "core/splat/raster/phase_clock.h"
#include "core/splat/raster/projection.h"
#include "core/splat/raster/rasterizer.h"

namespace color3d {

class SplatPipeline {
 public:
  // Passes record their time on `clock` (may be null), which must outlive the pipeline's use; they
  // leave it in Phase::kOther.
  void set_clock(PhaseClock* clock) { clock_ = clock; }

  // Draws the Gaussians; `background` has one number per channel. With `depth_channel` a last
  // channel holds sum(alpha T depth). Dropped Gaussians have no effect.
  void Forward(const SplatInput& input,
               const float* background,
               bool depth_channel,
               ThreadPool& pool,
               const SplatDropping& dropping = {});
  const PlaneBuffer& color() const { return color_; }
  const PlaneBuffer& transmittance() const { return transmittance_; }
  // With the depth channel only: depth of the Gaussian at which the opacity so far reaches 0.5; 0
  // where it never does.
  const PlaneBuffer& median_depth() const { return median_depth_; }
  size_t pair_count() const { return lists_.pair_count(); }

  // Gradient by the parameters of the last Forward (same input, no depth channel).
  void Backward(const SplatInput& input,
                const PlaneBuffer& d_color,
                ThreadPool& pool,
                const GradientOutput& output);

 private:
  void Enter(Phase phase) {
    if (clock_ != nullptr) clock_->Enter(phase);
  }

  PhaseClock* clock_ = nullptr;
  SplatBuffer splats_;
  TileBinner binner_;
  TileLists lists_;
  std::vector<uint16_t> block_masks_;
  AlignedFloats pair_gradient_;
  PlaneBuffer color_;
  PlaneBuffer transmittance_;
  PlaneBuffer median_depth_;
};

}  // namespace color3d
