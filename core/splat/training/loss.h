// The training loss of one picture and its gradient (GAUSSIANS.md "Stage 2"):
//   mean over channels and pixels of  w_l1 |x - y| + w_ssim (1 - SSIM(x, y))
//   + w_edge mean over inner pixels of sqrt((Lap x - Lap y)^2 + eps^2),
// with an 11x11 Gaussian window of sigma 1.5 and zero padding for SSIM (Wang et al. 2004), and the
// 4-neighbour Laplacian. Values are the normalised L', a', b' of range 1, so SSIM's constants are
// (0.01)^2 and (0.03)^2 for all; a' and b' use only a small part of that range, which makes their
// SSIM term mild (C2 dominates the chroma variance of flat regions).
#pragma once

#include "core/base/parallel.h"
#include "core/simd/plane_buffer.h"

namespace color3d {

inline constexpr float kSsimC1 = 0.01f * 0.01f;
inline constexpr float kSsimC2 = 0.03f * 0.03f;
inline constexpr float kCharbonnierEpsilon = 1e-3f;

struct LossWeights {
  float l1 = 0.8f;
  float ssim = 0.2f;
  float edge = 1.0f;
};

struct LossValue {
  double total = 0.0;
  double l1 = 0.0;    // unweighted mean |x - y|
  double ssim = 0.0;  // mean 1 - SSIM (times the pixel weights)
  double edge = 0.0;
};

// Not thread-safe; keeps its work space between calls.
class ImageLoss {
 public:
  // x, y: same size and channels. `pixel_weight` (1 channel, may be null) multiplies every pixel's
  // loss. `gradient` gets x's shape and dL/dx; zero outside of the picture.
  LossValue Evaluate(const PlaneBuffer& x,
                     const PlaneBuffer& y,
                     const PlaneBuffer* pixel_weight,
                     const LossWeights& weights,
                     ThreadPool& pool,
                     PlaneBuffer& gradient);

 private:
  std::vector<AlignedFloats> scratch_;  // per thread
  AlignedFloats zeros_;
  std::vector<double> row_sums_;
};

}  // namespace color3d
