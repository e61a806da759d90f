#include "core/image/feature_matches.h"

#include <Eigen/Core>

namespace color3d {
namespace {

using Rows = Eigen::Matrix<float, Eigen::Dynamic, LocalFeatures::kDimensions, Eigen::RowMajor>;
using Table = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Eigen::Map<const Rows> RowsOf(const LocalFeatures& features) {
  return {features.descriptors.data(), features.count(), LocalFeatures::kDimensions};
}

// The largest and second largest of a row or column of cosines.
struct Nearest {
  int index = -1;
  float best = -1.0f;
  float second = -1.0f;
  void Offer(int i, float cosine) {
    if (cosine > best) {
      second = best;
      best = cosine;
      index = i;
    } else if (cosine > second) {
      second = cosine;
    }
  }
  // Squared distance of unit vectors is 2 - 2 cos, up to rounding.
  bool Clear() const {
    constexpr float kRatio = 0.8f;
    constexpr float kRounding = 1e-5f;
    return 1.0f - best + kRounding < kRatio * kRatio * (1.0f - second);
  }
};

}  // namespace

std::vector<std::pair<int, int>> MutualMatches(const LocalFeatures& a, const LocalFeatures& b) {
  std::vector<std::pair<int, int>> matches;
  if (a.count() == 0 || b.count() == 0) return matches;
  const Table cosines = RowsOf(a) * RowsOf(b).transpose();
  std::vector<Nearest> of_a(a.count()), of_b(b.count());
  for (int i = 0; i < a.count(); ++i) {
    for (int j = 0; j < b.count(); ++j) {
      of_a[i].Offer(j, cosines(i, j));
      of_b[j].Offer(i, cosines(i, j));
    }
  }
  for (int i = 0; i < a.count(); ++i) {
    const int j = of_a[i].index;
    if (of_a[i].Clear() && of_b[j].index == i && of_b[j].Clear()) matches.emplace_back(i, j);
  }
  return matches;
}

}  // namespace color3d
