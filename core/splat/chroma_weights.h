// Blending weights of one 16x16 tile kept as numbers, so that the chroma solver multiplies with
// them again and again without projecting, sorting or exponentials: the rows of W in
// picture = W c. The products are bound by memory, so a weight has 8 bits relative to the largest
// of its block (errors average out to 1e-3 of a pixel's sum). Both products use the same rounded
// weights, so W^T D W stays symmetric and positive semidefinite. Internal to the splat module; no
// Eigen here, because the source is compiled for the machine's instruction set.
//
// A tile's picture is [block][channel][16]: blocks of 4x4 cells, row by row in the tile, and two
// channels. Cells are pixels (16 blocks) or, after CoarsenTileWeights, 4x4 pixels (1 block).
#pragma once

#include <cstdint>
#include <vector>

#include "core/splat/binning.h"
#include "core/splat/projection.h"

namespace color3d {

inline constexpr int kFineBlocks = 16;
inline constexpr int kBlockCells = 16;
inline constexpr int kTilePixels = kFineBlocks * kBlockCells;

// One block that an entry touches: weight[lane] * scale / (255 * 65535).
struct WeightItem {
  uint8_t weight[kBlockCells];
  uint16_t scale;
  uint16_t block;
};

struct TileWeights {
  std::vector<uint32_t> gaussian;    // of each entry, front to back
  std::vector<uint32_t> first_item;  // entries + 1
  std::vector<WeightItem> items;

  void Clear();
  void ShrinkToFit();
  int64_t Bytes() const;
};

// Position in the tile of cell `lane` of block `block`, in px (fine blocks).
constexpr int FineX(int block, int lane) { return block % 4 * 4 + lane % 4; }
constexpr int FineY(int block, int lane) { return block / 4 * 4 + lane / 4; }

// alpha T of every splat in the list of tile `tile`, as RasterizeForward blends it.
void BuildTileWeights(const SplatBuffer& splats,
                      const TileLists& lists,
                      int tile,
                      int width_px,
                      int height_px,
                      TileWeights& weights);

// Averages over 4x4 pixels with `pixel_weight` ([block][16]).
void CoarsenTileWeights(const TileWeights& fine, const float* pixel_weight, TileWeights& coarse);

// picture = W value; two values per Gaussian.
void TileForward(const TileWeights& weights, int blocks, const float* value, float* picture);

// sum += W^T picture; two sums per Gaussian.
void TileAdjoint(const TileWeights& weights, const float* picture, float* sum);

// sum += (W o W)^T picture, the diagonal of W^T D W for picture = D.
void TileSquares(const TileWeights& weights, const float* picture, float* sum);

}  // namespace color3d
