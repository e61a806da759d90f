#include "tests/bench/pretrain/copy_loss.h"

#include <torch/types.h>

#include <algorithm>
#include <tuple>

#include "core/matching/cell_features.h"

namespace color3d {
namespace {

constexpr double kEigenvalueFloor = 0.02;  // as in core/matching/whitening.cc
constexpr double kVarianceFloor = 1e-8;
constexpr double kRankFloor = 1e-4;     // of the largest eigenvalue, for rank-deficient samples
constexpr double kUniformShare = 1e-3;  // bounds the loss of colours missing in `first` to log 1000

// As in core/matching/whitening.cc.
double ShareOfTap(const WhiteningOptions& options, int stride_px) {
  size_t octave = 0;
  while (octave + 1 < options.tap_shares.size() && (4 << octave) <= stride_px) ++octave;
  return options.tap_shares[octave];
}

// The leading `dims` principal directions [C, dims] of standardised samples [n, C].
torch::Tensor PrincipalDirections(const torch::Tensor& x, int64_t dims) {
  torch::NoGradGuard no_grad;
  const auto n = static_cast<double>(x.size(0));
  const bool wide = x.size(1) > x.size(0);
  // With fewer samples than channels, the Gram matrix is smaller.
  const torch::Tensor matrix = (wide ? torch::mm(x, x.t()) : torch::mm(x.t(), x)).cpu() / n;
  torch::Tensor values, vectors;
  std::tie(values, vectors) = torch::linalg_eigh(matrix);  // ascending
  values = values.slice(0, values.size(0) - dims).to(x.device());
  vectors = vectors.slice(1, vectors.size(1) - dims).to(x.device());
  if (!wide) return vectors;
  const torch::Tensor floor = values.max() * kRankFloor;
  const torch::Tensor scale = torch::where(
      values > floor, (values.clamp_min(0.0) * n + 1e-12).rsqrt(), torch::zeros_like(values));
  return torch::mm(x.t(), vectors) * scale;
}

// Squared distances of all pairs.
torch::Tensor Distances(const torch::Tensor& x, const torch::Tensor& y) {
  const torch::Tensor d = torch::addmm(y.square().sum(1), x, y.t(), /*beta=*/1.0, /*alpha=*/-2.0);
  return (d + x.square().sum(1, true)).clamp_min(0.0);
}

// Centres of the cells [cells, 2], x and y in px.
torch::Tensor CellMiddles(int64_t rows, int64_t columns) {
  const torch::Tensor y = (torch::arange(rows, torch::kFloat32) + 0.5) * kCellPx;
  const torch::Tensor x = (torch::arange(columns, torch::kFloat32) + 0.5) * kCellPx;
  return torch::stack({x.unsqueeze(0).expand({rows, columns}).flatten(),
                       y.unsqueeze(1).expand({rows, columns}).flatten()},
                      1);
}

// Resamples projected features [h w, D] of a map [1,C,h,w] to `rows` rows of cells. Interpolation
// follows the projection because D is a tenth of C.
torch::Tensor ToCells(const torch::Tensor& projected, const torch::Tensor& map, int64_t rows) {
  if (map.size(2) == rows) return projected;
  const int64_t columns = map.size(3) * rows / map.size(2);
  const torch::Tensor grid = projected.t().reshape({1, -1, map.size(2), map.size(3)});
  return torch::upsample_bilinear2d(grid, {rows, columns}, /*align_corners=*/false)[0]
      .flatten(1)
      .t();
}

}  // namespace

torch::Tensor WhitenBlock(const torch::Tensor& samples,
                          const torch::Tensor& cells,
                          int dims,
                          double share) {
  const torch::Tensor mean = samples.mean(0);
  const torch::Tensor inverse = (samples.var(0, /*unbiased=*/false) + kVarianceFloor).rsqrt();
  const torch::Tensor standard = (samples - mean) * inverse;
  const int64_t kept = std::min<int64_t>({dims, samples.size(1), samples.size(0)});
  const torch::Tensor directions = PrincipalDirections(standard.detach(), kept);
  const torch::Tensor variance = torch::mm(standard, directions).square().mean(0);
  const torch::Tensor scale =
      share / static_cast<double>(kept) / (variance + kEigenvalueFloor * variance.max() + 1e-12);
  return torch::mm((cells - mean) * inverse, directions) * scale.sqrt();
}

CopyLosses CopyColors(const ConvNextConfig& encoder,
                      const CopyView& first,
                      const CopyView& second,
                      const torch::Tensor& matches,
                      const torch::Tensor& bin_weights,
                      const CopyLossOptions& options,
                      Random& random) {
  const auto device = matches.device();
  const int64_t bank_rows = first.luminance.size(2) / kCellPx;
  const int64_t bank_columns = first.luminance.size(3) / kCellPx;
  const torch::Tensor rows = SampleRows(matches.size(0), options.queries, random).to(device);
  std::vector<torch::Tensor> keys, queries;
  const auto add = [&](const torch::Tensor& of_first,
                       const torch::Tensor& of_second,
                       double share) {
    const torch::Tensor samples = of_first[0].flatten(1).t();
    const torch::Tensor both = torch::cat({samples, of_second[0].flatten(1).t()});
    const torch::Tensor white = WhitenBlock(samples, both, options.whitening.dims_per_block, share);
    const torch::Tensor bank = white.slice(0, 0, samples.size(0));
    const torch::Tensor cells = white.slice(0, samples.size(0));
    keys.push_back(ToCells(bank, of_first, bank_rows));
    queries.push_back(
        ToCells(cells, of_second, second.luminance.size(2) / kCellPx).index_select(0, rows));
  };
  for (size_t i = 0; i < first.taps.size(); ++i) {
    const int64_t stride = encoder.Stride(static_cast<int>(i));
    const auto pooled = [&](const torch::Tensor& tap) {
      const int64_t side = kCellPx / stride;
      return stride < kCellPx ? torch::avg_pool2d(tap, {side, side}) : tap;
    };
    add(pooled(first.taps[i]),
        pooled(second.taps[i]),
        ShareOfTap(options.whitening, static_cast<int>(stride)));
  }
  const auto statistics = [&](const CopyView& view) {
    const CellFeatures cells = DescribeCells(encoder, {}, view.luminance);
    return cells.blocks[0].t().view({1, -1, cells.rows, cells.columns});
  };
  add(statistics(first), statistics(second), options.whitening.luminance_share);
  const torch::Tensor d = Distances(torch::cat(queries, 1), torch::cat(keys, 1));
  const torch::Tensor best = d.detach().amin(1, /*keepdim=*/true);
  const torch::Tensor log_share = torch::log_softmax(
      (best - d) / (options.vote.temperature * (best + options.vote.distance_floor)), 1);
  CopyLosses losses;
  {
    const torch::Tensor copied = torch::mm(log_share.exp(), first.colors);
    const torch::Tensor truth = second.colors.index_select(0, rows);
    const auto bins = static_cast<double>(truth.size(1));
    const torch::Tensor mixed = (1.0 - kUniformShare) * copied + kUniformShare / bins;
    losses.copy = -((truth * mixed.log()).sum(1) * truth.mv(bin_weights)).mean();
  }
  const torch::Tensor places = matches.index_select(0, rows);
  const torch::Tensor known = (places.select(1, 0) >= 0.0).nonzero().squeeze(1);
  if (known.size(0) == 0) {
    losses.contrast = torch::zeros({}, d.options());
    return losses;
  }
  const torch::Tensor middles = CellMiddles(bank_rows, bank_columns).to(device);
  const torch::Tensor target =
      torch::softmax(Distances(places.index_select(0, known), middles) *
                         (-0.5 / (options.match_sigma_px * options.match_sigma_px)),
                     1);
  losses.contrast = -(target * log_share.index_select(0, known)).sum(1).mean();
  return losses;
}

}  // namespace color3d
