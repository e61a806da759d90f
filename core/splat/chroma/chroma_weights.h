// Stored blending weights of one 16x16 tile, so that the chroma solver multiplies with them
// repeatedly without projecting, sorting or exponentials: the rows of W in picture = W c. A weight
// is a 16-bit fixed-point number (step 1.5e-5). Both products use the same rounded weights, so W^T
// D W stays symmetric and positive semidefinite. Internal to the splat module; no Eigen here,
// because the source is compiled once per instruction set.
//
// A tile's picture is [block][channel][16]: blocks of 4x4 pixels, row by row in the tile, and two
// channels.
#pragma once

#include <cstdint>
#include <vector>

#include "core/splat/raster/binning.h"
#include "core/splat/raster/projection.h"
#include "core/splat/raster/raster_constants.h"

namespace color3d {

inline constexpr int kTilePixels = kTileBlocks * kBlockPixels;

// One block that an entry touches: weight / 65535.
struct WeightItem {
  uint16_t weight[kBlockPixels];
  uint32_t block;
};

struct TileWeights {
  std::vector<uint32_t> gaussian;    // of each entry, front to back
  std::vector<uint32_t> first_item;  // entries + 1
  std::vector<WeightItem> items;

  void Clear();
  int64_t Bytes() const;
};

// Position in the tile of pixel `lane` of block `block`, px.
constexpr int PixelX(int block, int lane) { return block % 4 * 4 + lane % 4; }
constexpr int PixelY(int block, int lane) { return block / 4 * 4 + lane / 4; }

// alpha T of every splat in the list of tile `tile`, as RasterizeForward blends it.
void BuildTileWeights(const SplatBuffer& splats,
                      const TileLists& lists,
                      int tile,
                      int width_px,
                      int height_px,
                      TileWeights& weights);

// picture = W value; two values per Gaussian.
void TileForward(const TileWeights& weights, const float* value, float* picture);

// sum += W^T picture; two sums per Gaussian.
void TileAdjoint(const TileWeights& weights, const float* picture, float* sum);

// sum += (W o W)^T picture, the diagonal of W^T D W for picture = D.
void TileSquares(const TileWeights& weights, const float* picture, float* sum);

}  // namespace color3d
