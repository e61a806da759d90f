// Projection of 3D Gaussians to 2D splats and its adjoint (EWA splatting: Zwicker et al. 2001;
// Kerbl et al. 2023). Internal to the splat module; no Eigen here, because the kernels are compiled
// once per instruction set. All functions are deterministic for every thread count.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/parallel.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/raster/raster_camera.h"

namespace color3d {

// Columns of a splat's row. log2(alpha at pixel p) = kLog2Opacity - kInvX * e^2 - kInvY * dy^2 with
// d = p - (u, v) and e = dx - kSlope * dy: the LDL' form of the conic, a sum of squares that cannot
// lose its sign to rounding.
enum SplatColumn {
  kU,
  kV,
  kInvX,   // 0.5 log2(e) / var(x | y)
  kSlope,  // cov(x, y) / var(y)
  kInvY,   // 0.5 log2(e) / var(y)
  kLog2Opacity,
  kSplatColor,  // the colour channels follow
};

// Columns of a splat's gradient: sums over pixels of w = dL/d ln(alpha) times moments.
enum SplatGradientColumn {
  kSumW,
  kSumWE,
  kSumWDy,
  kSumWEE,
  kSumWEDy,
  kSumWDyDy,
  kGradientColor,  // the colour channels follow
};

// 6 geometry columns and the channels, padded.
constexpr int SplatRowFloats(int channels) { return channels <= 2 ? 8 : 12; }
// A gradient row's columns, padded.
constexpr int GradientRowFloats(int channels) { return kGradientColor + channels <= 8 ? 8 : 12; }

struct SplatBuffer {
  int channels = 0;  // colour channels, and one for depth if requested
  int row_floats = 8;
  AlignedFloats rows;               // one row per Gaussian
  std::vector<uint32_t> depth_key;  // bits of the camera depth; 0: not visible
};

// Gaussians and the camera that sees them.
struct SplatInput {
  const ParameterBlock& parameters;
  const ColorSpec& color;
  const RasterCamera& camera;
};

void ProjectSplats(const SplatInput& input,
                   bool depth_channel,
                   ThreadPool& pool,
                   SplatBuffer& splats);

// Drops Gaussians at random (DropGaussian: Park et al. 2025); the others have 1 / (1 - rate) times
// their opacity, before the cap on alpha. Gradients are unaffected, because ln(opacity) only gains
// a constant.
struct SplatDropping {
  double rate = 0.0;  // 0..0.9
  uint64_t seed = 0;  // selects the dropped ones
};
void DropSplats(const SplatDropping& dropping, ThreadPool& pool, SplatBuffer& splats);

// Sums over the views since densification, per Gaussian.
struct DensifyStatistics {
  AlignedFloats gradient;  // |dL/d(u, v)|, NDC units
  AlignedFloats count;     // views that saw it
  AlignedFloats radius;    // largest standard deviation on the screen, fraction of the image width
  void Reset(int64_t gaussians);
};

// The parameters whose gradients are computed.
enum class GradientScope { kAll, kColorOnly };

struct GradientOutput {
  GradientScope scope;
  // Gets the shape of the parameters. Rows out of scope and Gaussians that are not visible get
  // zeros.
  ParameterBlock& parameters;
  DensifyStatistics* statistics = nullptr;  // may be null
};

// `pair_gradient` holds one gradient row of GradientRowFloats(channels) for each (Gaussian, tile)
// pair; those of Gaussian i are [first_pair[i], first_pair[i + 1]).
void ProjectSplatsBackward(const SplatInput& input,
                           const SplatBuffer& splats,
                           const AlignedFloats& pair_gradient,
                           const std::vector<uint32_t>& first_pair,
                           ThreadPool& pool,
                           const GradientOutput& output);

}  // namespace color3d
