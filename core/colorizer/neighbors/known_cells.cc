#include "core/colorizer/neighbors/known_cells.h"

#include <torch/types.h>

#include <utility>

#include "core/colorizer/model/padding.h"
#include "core/encoder/image_tensors.h"
#include "core/matching/cell_features.h"

namespace color3d {
namespace {

constexpr double kWeightFloor = 1e-6;
constexpr double kMinKnownShare = 0.5;  // minimum share of a cell with known positions

}  // namespace

torch::Tensor PaddedTensor(const Image& image) {
  return PadToMultiple(TensorFromImage(image), kPadMultiple);
}

torch::Tensor CellPositions(const Image& position, int64_t count) {
  if (position.Empty()) return torch::zeros({count, 4});
  const torch::Tensor cells = CellMeans(PaddedTensor(position));
  const torch::Tensor share = cells.slice(1, 3, 4);
  return torch::cat({cells.slice(1, 0, 3) / share.clamp_min(kMinKnownShare),
                     (share > kMinKnownShare).to(torch::kFloat32)},
                    1);
}

KnownCells ComputeKnownCells(const TapEncoder& encoder,
                             const TrainingPicture& picture,
                             const RelativeChroma& relative) {
  const torch::Tensor l = PaddedTensor(picture.luminance);
  CellFeatures features = DescribeCells(encoder.config(), encoder.Taps(encoder.Input(l)), l);
  const int64_t count = features.Count();
  KnownCells cells;
  cells.blocks = std::move(features.blocks);
  cells.positions = CellPositions(picture.position, count);
  const Image color = ToRelative(relative, picture.luminance, picture.ab);
  if (picture.weight.Empty()) {
    cells.colors = CellMeans(PaddedTensor(color));
    cells.weights = torch::ones({count});
    return cells;
  }
  // Weighted mean over the pixels.
  const torch::Tensor weight = PaddedTensor(picture.weight);
  const torch::Tensor mean_weight = CellMeans(weight);
  cells.colors = CellMeans(PaddedTensor(color) * weight) / mean_weight.clamp_min(kWeightFloor);
  cells.weights = mean_weight.squeeze(1).contiguous();
  return cells;
}

KnownCells Join(const std::vector<KnownCells>& parts) {
  KnownCells all;
  for (size_t i = 0; i < parts.front().blocks.size(); ++i) {
    std::vector<torch::Tensor> blocks;
    for (const KnownCells& part : parts) blocks.push_back(part.blocks[i]);
    all.blocks.push_back(torch::cat(blocks));
  }
  std::vector<torch::Tensor> colors, weights, positions;
  for (const KnownCells& part : parts) {
    colors.push_back(part.colors);
    weights.push_back(part.weights);
    positions.push_back(part.positions);
  }
  all.colors = torch::cat(colors);
  all.weights = torch::cat(weights);
  all.positions = torch::cat(positions);
  return all;
}

KnownCells Select(const KnownCells& cells, const torch::Tensor& rows) {
  return {SelectRows(cells.blocks, rows),
          cells.colors.index_select(0, rows),
          cells.weights.index_select(0, rows),
          cells.positions.index_select(0, rows)};
}

}  // namespace color3d
