// A deterministic random scene and the steps of one training iteration on it, to measure the
// numeric kernels separately.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/parallel.h"
#include "core/splat/raster/binning.h"
#include "core/splat/raster/rasterizer.h"
#include "core/splat/training/adam.h"
#include "core/splat/training/loss.h"

namespace color3d {

struct SyntheticLoad {
  int gaussians = 50'000;
  int width_px = 500;
  int height_px = 375;
  int channels = 1;  // 1 or 3, each with degree 3 harmonics
};

// Gaussians fill the picture evenly. Their size decreases with their number, down to a pixel, so
// that some tens of them cover each pixel.
class SyntheticIteration {
 public:
  SyntheticIteration(const SyntheticLoad& load, int threads);

  void Project();
  void Bin();
  void Forward();
  void Loss();
  void Backward();
  void ProjectBackward();
  void Adam();

  int64_t VisibleGaussians() const;
  int64_t Pairs() const { return static_cast<int64_t>(lists_.pair_count()); }
  // Number of pixels of the 4x4 blocks that Gaussians reach before the tile is opaque, summed over
  // all Gaussians. Renders the picture again.
  int64_t CoveredPixels();

 private:
  SyntheticLoad load_;
  ThreadPool pool_;
  RasterCamera camera_;
  ColorSpec color_;
  ParameterBlock parameters_, gradient_;
  AdamMoments moments_;
  std::vector<float> learning_rates_;
  DensifyStatistics statistics_;
  SplatBuffer splats_;
  TileBinner binner_;
  TileLists lists_;
  std::vector<uint16_t> block_masks_;
  PlaneBuffer picture_, transmittance_, target_, d_picture_;
  AlignedFloats pair_gradient_;
  ImageLoss loss_;
  int64_t step_ = 0;
};

}  // namespace color3d
