#include "core/matching/cell_features.h"

#include <torch/types.h>

#include <algorithm>
#include <numeric>
#include <utility>

namespace color3d {
namespace {

constexpr int kWindowRadii[] = {1, 3, 9};  // radii of the windows, in cells
static_assert(kLuminanceStatistics == 1 + 2 * std::size(kWindowRadii));
constexpr double kMaxLuminance = 100.0;
// Variance of L in 0..1: a deviation below a third of a unit of L is rounding.
constexpr double kMapVarianceFloor = 1e-5;

// Means over squares of `side`, clipped at the right and lower borders.
torch::Tensor MeanPool(const torch::Tensor& x, int64_t side) {
  return torch::avg_pool2d(x,
                           {side, side},
                           {side, side},
                           /*padding=*/{0, 0},
                           /*ceil_mode=*/true,
                           /*count_include_pad=*/false);
}

// Mean over a (2 radius + 1)^2 window, clipped at the borders.
torch::Tensor WindowMean(const torch::Tensor& x, int radius) {
  return torch::avg_pool2d(x,
                           {2 * radius + 1, 2 * radius + 1},
                           {1, 1},
                           {radius, radius},
                           /*ceil_mode=*/false,
                           /*count_include_pad=*/false);
}

// [1,K,rows,columns]: local statistics of L, which normalised encoder features lack.
torch::Tensor LuminanceStatistics(const torch::Tensor& luminance) {
  const torch::Tensor unit = luminance / kMaxLuminance;
  const torch::Tensor l = MeanPool(unit, kCellPx);
  const torch::Tensor ll = MeanPool(unit.square(), kCellPx);
  std::vector<torch::Tensor> maps{l};
  for (int radius : kWindowRadii) {
    const torch::Tensor mean = WindowMean(l, radius);
    const torch::Tensor variance = (WindowMean(ll, radius) - mean.square()).clamp_min(0.0);
    maps.push_back(mean);
    maps.push_back((variance + kMapVarianceFloor).sqrt());
  }
  return torch::cat(maps, 1);
}

// [1,C,rows,columns] -> [cells, C].
torch::Tensor ByCell(const torch::Tensor& map) { return map[0].flatten(1).t(); }

int64_t CeilDivide(int64_t value, int64_t by) { return (value + by - 1) / by; }

}  // namespace

CellFeatures DescribeCells(const ConvNextConfig& encoder,
                           const std::vector<torch::Tensor>& taps,
                           const torch::Tensor& luminance) {
  CellFeatures cells;
  const int64_t height = luminance.size(2), width = luminance.size(3);
  cells.rows = CeilDivide(height, kCellPx);
  cells.columns = CeilDivide(width, kCellPx);
  for (size_t i = 0; i < taps.size(); ++i) {
    const int64_t stride = encoder.Stride(static_cast<int>(i));
    const int64_t tap_rows = CeilDivide(height, stride), tap_columns = CeilDivide(width, stride);
    torch::Tensor map = taps[i].slice(2, 0, tap_rows).slice(3, 0, tap_columns);
    if (stride < kCellPx) {
      map = MeanPool(map, kCellPx / stride);
    } else if (stride > kCellPx) {
      const int64_t factor = stride / kCellPx;
      map = torch::upsample_bilinear2d(
          map, {tap_rows * factor, tap_columns * factor}, /*align_corners=*/false);
      map = map.slice(2, 0, cells.rows).slice(3, 0, cells.columns);
    }
    cells.blocks.push_back(ByCell(map));
  }
  cells.blocks.push_back(ByCell(LuminanceStatistics(luminance)));
  return cells;
}

torch::Tensor CellMeans(const torch::Tensor& picture) { return ByCell(MeanPool(picture, kCellPx)); }

torch::Tensor SampleRows(int64_t count, int64_t wanted, Random& random) {
  std::vector<int64_t> rows(count);
  std::iota(rows.begin(), rows.end(), int64_t{0});
  const int64_t taken = std::min(count, wanted);
  for (int64_t i = 0; i < taken; ++i) {
    std::swap(rows[i], rows[i + random.NextBelow(static_cast<uint32_t>(count - i))]);
  }
  return torch::tensor(std::vector<int64_t>(rows.begin(), rows.begin() + taken), torch::kInt64);
}

std::vector<torch::Tensor> SelectRows(const std::vector<torch::Tensor>& blocks,
                                      const torch::Tensor& rows) {
  std::vector<torch::Tensor> selected;
  for (const torch::Tensor& block : blocks) selected.push_back(block.index_select(0, rows));
  return selected;
}

}  // namespace color3d
