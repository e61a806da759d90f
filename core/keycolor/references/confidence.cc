#include "core/keycolor/references/confidence.h"

#include <torch/types.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace color3d {
namespace {

constexpr double kAgreementWidth =
    12.0;  // spread of the voters' colours, Lab units, at which they disagree
constexpr float kSameCell = 1e-4f;  // squared distance of a cell to itself, up to rounding

double Median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

torch::Tensor Confidence(const CellMatches& matches, double distance_scale) {
  const int64_t count = matches.distance.size(0);
  torch::Tensor confidence = torch::empty({count});
  const float* distances = matches.distance.data_ptr<float>();
  const float* variances = matches.variance.data_ptr<float>();
  const float* from_bank = matches.bank_distance.data_ptr<float>();
  const int64_t* nearest = matches.nearest.data_ptr<int64_t>();
  for (int64_t i = 0; i < count; ++i) {
    const double distance = distances[i];
    const double agreement = std::exp(-0.5 * variances[i] / (kAgreementWidth * kAgreementWidth));
    const double mutual = (from_bank[nearest[i]] + kDistanceFloor) / (distance + kDistanceFloor);
    const double closeness = std::exp(-std::pow(distance / (distance_scale + kDistanceFloor), 2));
    confidence.data_ptr<float>()[i] =
        static_cast<float>(agreement * closeness * std::sqrt(std::min(1.0, mutual)));
  }
  return confidence;
}

double DistanceScale(const torch::Tensor& sample, const torch::Tensor& features) {
  const torch::Tensor d = SquaredDistances(sample, features);
  const int64_t entries = d.size(1);
  std::vector<float> nearest, any;
  for (int64_t q = 0; q < d.size(0); ++q) {
    const float* row = d.data_ptr<float>() + q * entries;
    float best = std::numeric_limits<float>::infinity();
    for (int64_t k = 0; k < entries; ++k) {
      if (row[k] > kSameCell) best = std::min(best, row[k]);
    }
    if (std::isfinite(best)) nearest.push_back(best);
    any.push_back(row[(q + entries / 2) % entries]);
  }
  if (nearest.empty()) return 1.0;
  return std::sqrt(Median(nearest) * Median(any));
}

}  // namespace color3d
