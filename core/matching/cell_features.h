// Features of a picture in cells of 4 px: feature maps of the frozen encoder and local statistics
// of luminance. Torch in the interface. Pure functions, thread-safe.
#pragma once

#include <torch/types.h>

#include <cstdint>
#include <vector>

#include "core/base/random.h"
#include "core/encoder/convnext/convnext_config.h"

namespace color3d {

inline constexpr int kCellPx = 4;
// L, and its mean and standard deviation in three windows.
inline constexpr int64_t kLuminanceStatistics = 7;

struct CellFeatures {
  int64_t rows = 0;
  int64_t columns = 0;
  // [cells, channels] each, cells row by row: one block per tap, fine to coarse, then the luminance
  // statistics.
  std::vector<torch::Tensor> blocks;

  int64_t Count() const { return blocks.front().size(0); }
};

// Returns the features of a picture with L `luminance` [1,1,H,W] (0..100) and the encoder's `taps`
// [1,C,h,w], which may include padding to the right and below. Cells that the picture fills in part
// use that part only.
CellFeatures DescribeCells(const ConvNextConfig& encoder,
                           const std::vector<torch::Tensor>& taps,
                           const torch::Tensor& luminance);

// Returns the mean of each plane of a picture [1,C,H,W] over each cell, [cells, C].
torch::Tensor CellMeans(const torch::Tensor& picture);

// Returns `wanted` of the rows 0..count-1, sampled without replacement, or all of them in random
// order if there are fewer.
torch::Tensor SampleRows(int64_t count, int64_t wanted, Random& random);
// Returns the given rows of every block.
std::vector<torch::Tensor> SelectRows(const std::vector<torch::Tensor>& blocks,
                                      const torch::Tensor& rows);

}  // namespace color3d
