// Targets and pixel weights of one tile, in the order of chroma_weights.h. Internal to the splat
// module. Pure functions.
#pragma once

#include <array>

#include "core/splat/chroma/chroma_targets.h"
#include "core/splat/chroma/chroma_weights.h"

namespace color3d {

inline constexpr int kTileFloats = 2 * kTilePixels;  // of a tile's picture

// D = weight / max(|residual|, floor) * scale for least absolute residuals by reweighting (Holland
// & Welsch 1977), or the plain weight. All in units of a' and b'.
struct RobustWeights {
  bool on = true;
  double scale = 4.0 / 255.0;
  double floor =
      0.25 / 255.0;  // below it |residual| becomes quadratic: half a step of 8-bit chroma
};

// Reads the tile whose first pixel is (x0, y0): kTileFloats targets and kTilePixels weights. Pixels
// outside the picture or of weight 0 get zeros.
void LoadTile(const ChromaPlanes& planes, int x0, int y0, float* target, float* mask);

// Reads the tile's weights `mask`: weights in the first channel, times confidence in the second.
void LoadConfidence(const PlaneBuffer& confidence, int x0, int y0, const float* mask, float* sure);

// Computes D of a tile from the residuals target - picture, which overwrite `picture`. Returns the
// sums of weight * |residual| and of the weights.
std::array<float, 2> WeighTile(
    const RobustWeights& robust, const float* target, const float* mask, float* picture, float* d);

}  // namespace color3d
