#include "core/matching/whitening.h"

#include <torch/types.h>

#include <algorithm>
#include <tuple>
#include <utility>

namespace color3d {
namespace {

constexpr double kEigenvalueFloor = 0.02;  // share of the largest eigenvalue
constexpr double kVarianceFloor = 1e-8;    // a constant channel is divided by this, not by 0
constexpr double kScaleFloor = 1e-12;
constexpr int64_t kVectorColumns = 8;

double ShareOfTap(const WhiteningOptions& options, int stride_px) {
  size_t octave = 0;
  while (octave + 1 < options.tap_shares.size() && (4 << octave) <= stride_px) ++octave;
  return options.tap_shares[octave];
}

// Whitening to the leading principal components, in float64. `share` scales the block so that each
// kind of feature takes the share of the distance that it is given.
Whitening::Projection Fit(const torch::Tensor& samples, int64_t dims, double share) {
  const torch::Tensor x = samples.to(torch::kFloat64);
  const torch::Tensor mean = x.mean(0);
  const torch::Tensor inverse_deviation = (x.var(0, /*unbiased=*/false) + kVarianceFloor).rsqrt();
  const torch::Tensor standardised = (x - mean) * inverse_deviation;
  const torch::Tensor covariance =
      torch::mm(standardised.t(), standardised) / static_cast<double>(x.size(0));
  torch::Tensor values, vectors;
  std::tie(values, vectors) = torch::linalg_eigh(covariance);  // ascending
  dims = std::min<int64_t>(dims, x.size(1));
  values = values.slice(0, x.size(1) - dims);
  vectors = vectors.slice(1, x.size(1) - dims);
  const torch::Tensor floor = values.max() * kEigenvalueFloor;
  const torch::Tensor scale =
      share / static_cast<double>(dims) / (values.clamp_min(0.0) + floor + kScaleFloor);
  Whitening::Projection projection;
  projection.mean = mean.to(torch::kFloat32);
  projection.matrix = (inverse_deviation.unsqueeze(1) * vectors * scale.sqrt()).to(torch::kFloat32);
  return projection;
}

int64_t ColumnsOf(const std::vector<Whitening::Projection>& projections) {
  int64_t columns = 0;
  for (const Whitening::Projection& projection : projections) columns += projection.matrix.size(1);
  return (columns + kVectorColumns - 1) / kVectorColumns * kVectorColumns;
}

}  // namespace

Whitening::Whitening(const std::vector<torch::Tensor>& blocks,
                     int first_stride_px,
                     const WhiteningOptions& options) {
  for (size_t i = 0; i < blocks.size(); ++i) {
    const bool is_tap = i + 1 < blocks.size();
    const double share =
        is_tap ? ShareOfTap(options, first_stride_px << i) : options.luminance_share;
    projections_.push_back(Fit(blocks[i], options.dims_per_block, share));
  }
  columns_ = ColumnsOf(projections_);
}

Whitening::Whitening(std::vector<Projection> projections)
    : projections_(std::move(projections)), columns_(ColumnsOf(projections_)) {}

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
