#include "core/colorizer/neighbors/change_field.h"

#include <ATen/ops/cholesky_inverse.h>
#include <ATen/ops/linalg_cholesky.h>
#include <torch/types.h>

#include <algorithm>
#include <utility>

#include "core/matching/cell_matches.h"

namespace color3d {
namespace {

constexpr double kUnknownApart = 0.8;  // distance of known positions from unknown ones
constexpr double kMinWeight = 0.05;
constexpr double kSamePlace = 0.75;  // share of the maximum covariance
constexpr double kWorthInferring = 1e-5;
constexpr double kLeastShare = 1e-4;  // that a reach above 1 amplifies

// Unknown positions coincide, away from all known ones.
torch::Tensor EmbedPositions(const torch::Tensor& positions) {
  const torch::Tensor known = positions.slice(1, 3, 4);
  return torch::cat({positions.slice(1, 0, 3) * known, (1.0 - known) * kUnknownApart}, 1);
}

FieldPlaces Rows(const FieldPlaces& places, const torch::Tensor& rows) {
  return {places.features.index_select(0, rows),
          places.colors.index_select(0, rows),
          places.positions.index_select(0, rows),
          places.seen.index_select(0, rows)};
}

// Mean of the wanted values of the painted places, weighted by similarity.
torch::Tensor WeightedTarget(const torch::Tensor& similarity, const torch::Tensor& wanted) {
  const torch::Tensor weights = similarity.square();
  return torch::matmul(weights, wanted) / weights.sum(1, /*keepdim=*/true).clamp_min(1e-12);
}

// Returns the part of `change` that leads towards `limit`, at most up to it. Rows are (a, b).
torch::Tensor LimitTo(const torch::Tensor& limit, const torch::Tensor& change) {
  const torch::Tensor length = change.square().sum(1, /*keepdim=*/true).clamp_min(1e-9);
  return change * ((limit * change).sum(1, /*keepdim=*/true) / length).clamp(0.0, 1.0);
}

}  // namespace

ChangeField::ChangeField(FieldPlaces places,
                         torch::Tensor wanted,
                         const torch::Tensor& weights,
                         const torch::Tensor& correction_of_row,
                         const torch::Tensor& reach_of_row,
                         const ChangeFieldOptions& options)
    : options_(options), places_(std::move(places)), wanted_(std::move(wanted)) {
  if (wanted_.size(0) == 0) return;
  torch::Tensor covariance = Covariance(places_, places_);
  const double most = options_.wide + options_.near;
  const torch::Tensor later = correction_of_row.unsqueeze(0) > correction_of_row.unsqueeze(1);
  const torch::Tensor repeated =
      torch::logical_and(covariance > kSamePlace * most, later).any(/*dim=*/1);
  const torch::Tensor rows = repeated.logical_not().nonzero().squeeze(1);
  places_ = Rows(places_, rows);
  wanted_ = wanted_.index_select(0, rows);
  is_last_ =
      (correction_of_row.index_select(0, rows) == correction_of_row.max()).to(torch::kFloat32);
  const torch::Tensor reach = reach_of_row.index_select(0, rows);
  if ((reach != 1.0).any().item<bool>()) narrowing_ = reach.reciprocal();
  covariance = covariance.index_select(0, rows).index_select(1, rows).to(torch::kFloat64);
  const torch::Tensor noise =
      options_.noise / weights.index_select(0, rows).to(torch::kFloat64).clamp_min(kMinWeight);
  inverse_ = at::cholesky_inverse(at::linalg_cholesky(covariance + torch::diag(noise)));
  inverse_x_change_ =
      torch::matmul(inverse_, (wanted_ - places_.colors).to(torch::kFloat64)).to(torch::kFloat32);
  inverse_ = inverse_.to(torch::kFloat32);
}

torch::Tensor ChangeField::Covariance(const FieldPlaces& a, const FieldPlaces& b) const {
  const torch::Tensor apart = SquaredDistances(a.features, b.features);
  const torch::Tensor space =
      SquaredDistances(EmbedPositions(a.positions), EmbedPositions(b.positions)).clamp_min_(0.0);
  const torch::Tensor seen = (a.seen.unsqueeze(1) - b.seen.unsqueeze(0)).abs_();
  const torch::Tensor wide = (apart / -options_.wide_feature_reach).exp_() /
                             (1.0 + space.sqrt() / options_.wide_space_reach);
  const torch::Tensor near = (apart / -options_.near_feature_reach -
                              space / (options_.near_space_reach * options_.near_space_reach))
                                 .exp_();
  return (options_.wide * wide + options_.near * near) * (seen / -options_.seen_reach).exp_();
}

ChangeField::Answer ChangeField::At(const FieldPlaces& places) const {
  const int64_t count = places.features.size(0);
  if (!inverse_.defined()) {
    return {torch::zeros({count, 2}), torch::zeros({count}), torch::zeros({count})};
  }
  const torch::Tensor similarity = Covariance(places, places_);
  const torch::Tensor explained = (torch::matmul(similarity, inverse_) * similarity).sum(1);
  torch::Tensor change = torch::matmul(similarity, inverse_x_change_);
  torch::Tensor share = (explained / (options_.wide + options_.near)).clamp_(0.0, 1.0);
  const torch::Tensor pull = share * WeightedTarget(similarity, is_last_.unsqueeze(1)).squeeze(1);
  if (narrowing_.defined()) {
    const torch::Tensor power = WeightedTarget(similarity, narrowing_.unsqueeze(1)).squeeze(1);
    change = change * share.clamp_min(kLeastShare).pow(power - 1.0).unsqueeze(1);
    share = share.pow(power);
  }
  return {LimitTo(WeightedTarget(similarity, wanted_) - places.colors, change), share, pull};
}

std::vector<ChangeField::Proposal> ChangeField::Propose(const FieldPlaces& places,
                                                        const torch::Tensor& deviation,
                                                        int count) const {
  const torch::Tensor scale = deviation.unsqueeze(1) * deviation.unsqueeze(0);
  // Posterior covariance of the places, given the painted ones.
  torch::Tensor covariance = Covariance(places, places);
  if (inverse_.defined()) {
    const torch::Tensor similarity = Covariance(places, places_);
    covariance -= torch::matmul(torch::matmul(similarity, inverse_), similarity.t());
  }
  covariance *= scale;
  const double total = (options_.wide + options_.near) * deviation.square().sum().item<double>();
  const torch::Tensor noise = options_.noise * deviation.square();
  std::vector<Proposal> proposals;
  while (static_cast<int>(proposals.size()) < count) {
    const torch::Tensor gains =
        covariance.square().sum(1) / (covariance.diagonal().clamp_min(0.0) + noise + 1e-12);
    const int64_t row = gains.argmax().item<int64_t>();
    const double gain = gains[row].item<double>() / total;
    if (!(gain > kWorthInferring)) break;
    proposals.push_back({row, gain});
    const torch::Tensor explained = covariance[row].clone();
    const double variance =
        std::max(explained[row].item<double>(), 0.0) + noise[row].item<double>();
    covariance -= explained.unsqueeze(1) * explained.unsqueeze(0) / (variance + 1e-12);
  }
  return proposals;
}

}  // namespace color3d
