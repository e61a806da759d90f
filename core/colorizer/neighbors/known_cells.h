// Cells of pictures with known colours, before projection of their features. Torch in the
// interface; used inside core/colorizer only. Pure functions, thread-safe.
#pragma once

#include <torch/types.h>

#include <vector>

#include "core/color/relative_chroma.h"
#include "core/colorizer/colorizer.h"
#include "core/encoder/tap_encoder.h"

namespace color3d {

struct KnownCells {
  std::vector<torch::Tensor> blocks;  // as in CellFeatures
  torch::Tensor colors;               // [n,2], Lab units, relative to luminance
  torch::Tensor weights;              // [n], 0..1
  torch::Tensor positions;            // [n,4], as in CellBank
};

// Returns [1,C,H,W], padded to kPadMultiple.
torch::Tensor PaddedTensor(const Image& image);

// Returns [count,4], the mean known position of each cell, as in CellBank.
torch::Tensor CellPositions(const Image& position, int64_t count);

KnownCells ComputeKnownCells(const TapEncoder& encoder,
                             const TrainingPicture& picture,
                             const RelativeChroma& relative);

// Concatenates the rows of `parts`. Requires: at least one part.
KnownCells Join(const std::vector<KnownCells>& parts);
KnownCells Select(const KnownCells& cells, const torch::Tensor& rows);

}  // namespace color3d
