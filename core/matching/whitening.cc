#include "core/matching/whitening.h"

#include <torch/types.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace color3d {
namespace {

constexpr double kEigenvalueFloor = 0.02;  // share of the largest eigenvalue
constexpr double kNoiseFloor = 0.005;      // share of the mean noise variance
constexpr double kVarianceFloor = 1e-8;    // divisor for constant channels
constexpr double kScaleFloor = 1e-12;
constexpr int64_t kVectorColumns = 8;

double ShareOfTap(const WhiteningOptions& options, int stride_px) {
  size_t octave = 0;
  while (octave + 1 < options.tap_shares.size() && (4 << octave) <= stride_px) ++octave;
  return options.tap_shares[octave];
}

// The last `dims` columns.
torch::Tensor Leading(const torch::Tensor& ascending, int64_t dims) {
  const int64_t columns = ascending.size(-1);
  return ascending.slice(-1, columns - dims, columns);
}

// Leading principal components, scaled to equal variance, [C,D].
torch::Tensor PrincipalDirections(const torch::Tensor& covariance, int64_t dims) {
  torch::Tensor values, vectors;
  std::tie(values, vectors) = torch::linalg_eigh(covariance);  // ascending
  values = Leading(values, dims);
  const torch::Tensor floor = values.max() * kEigenvalueFloor;
  const torch::Tensor scale =
      1.0 / static_cast<double>(dims) / (values.clamp_min(0.0) + floor + kScaleFloor);
  return Leading(vectors, dims) * scale.sqrt();
}

// Directions of highest variance between places relative to the noise, in units of the noise,
// scaled to a total variance of 1, [C,D].
torch::Tensor DistinctiveDirections(const torch::Tensor& covariance,
                                    const torch::Tensor& noise,
                                    int64_t dims) {
  const int64_t channels = covariance.size(0);
  const double mean = noise.diagonal().mean().item<double>();
  const torch::Tensor softened =
      noise + (kNoiseFloor * mean + kScaleFloor) * torch::eye(channels, noise.options());
  torch::Tensor values, vectors;
  std::tie(values, vectors) = torch::linalg_eigh(softened);
  const torch::Tensor in_noise = torch::mm(vectors * values.rsqrt(), vectors.t());
  std::tie(values, vectors) =
      torch::linalg_eigh(torch::mm(torch::mm(in_noise, covariance), in_noise));
  const torch::Tensor total = Leading(values, dims).clamp_min(0.0).sum() + kScaleFloor;
  return torch::mm(in_noise, Leading(vectors, dims)) / total.sqrt();
}

// Computes in float64. `share`: share of the block in the distance. `noise`: [C,C], or undefined.
Whitening::Projection Fit(const torch::Tensor& samples,
                          int64_t dims,
                          double share,
                          const torch::Tensor& noise) {
  const torch::Tensor x = samples.to(torch::kFloat64);
  const torch::Tensor mean = x.mean(0);
  const torch::Tensor inverse_deviation = (x.var(0, /*unbiased=*/false) + kVarianceFloor).rsqrt();
  const torch::Tensor standardized = (x - mean) * inverse_deviation;
  const torch::Tensor covariance =
      torch::mm(standardized.t(), standardized) / static_cast<double>(x.size(0));
  dims = std::min<int64_t>(dims, x.size(1));
  const torch::Tensor directions =
      noise.defined()
          ? DistinctiveDirections(
                covariance, noise * torch::outer(inverse_deviation, inverse_deviation), dims)
          : PrincipalDirections(covariance, dims);
  Whitening::Projection projection;
  projection.mean = mean.to(torch::kFloat32);
  projection.matrix =
      (inverse_deviation.unsqueeze(1) * directions * std::sqrt(share)).to(torch::kFloat32);
  return projection;
}

int64_t PaddedColumns(const std::vector<Whitening::Projection>& projections) {
  int64_t columns = 0;
  for (const Whitening::Projection& projection : projections) columns += projection.matrix.size(1);
  return (columns + kVectorColumns - 1) / kVectorColumns * kVectorColumns;
}

}  // namespace

Whitening::Whitening(const std::vector<torch::Tensor>& blocks,
                     int first_stride_px,
                     const WhiteningOptions& options,
                     const std::vector<torch::Tensor>& view_noise) {
  for (size_t i = 0; i < blocks.size(); ++i) {
    const bool is_tap = i + 1 < blocks.size();
    const double share =
        is_tap ? ShareOfTap(options, first_stride_px << i) : options.luminance_share;
    const torch::Tensor noise = view_noise.empty() ? torch::Tensor() : view_noise[i];
    projections_.push_back(Fit(blocks[i], options.dims_per_block, share, noise));
  }
  columns_ = PaddedColumns(projections_);
}

Whitening::Whitening(std::vector<Projection> projections)
    : projections_(std::move(projections)), columns_(PaddedColumns(projections_)) {}

torch::Tensor Whitening::Apply(const std::vector<torch::Tensor>& blocks) const {
  std::vector<torch::Tensor> parts;
  int64_t columns = 0;
  for (size_t i = 0; i < blocks.size(); ++i) {
    parts.push_back(torch::mm(blocks[i] - projections_[i].mean, projections_[i].matrix));
    columns += parts.back().size(1);
  }
  if (columns < columns_) {
    parts.push_back(torch::zeros({blocks.front().size(0), columns_ - columns}));
  }
  return torch::cat(parts, 1);
}

}  // namespace color3d
