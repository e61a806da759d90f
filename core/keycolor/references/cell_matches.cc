#include "core/keycolor/references/cell_matches.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace color3d {
namespace {

constexpr int64_t kQueriesAtOnce = 256;
constexpr double kDistanceFloor = 0.02;   // squared; features are noisy
constexpr double kAgreementWidth = 12.0;  // Lab units of spread at which candidates contradict

// Squared distances of rows of `queries` to all rows of `bank`.
CellMatrix Distances(const Eigen::Ref<const CellMatrix>& queries,
                     const CellMatrix& bank,
                     const Eigen::RowVectorXf& bank_squares) {
  CellMatrix d = queries * bank.transpose();
  d = (-2.0f * d).rowwise() + bank_squares;
  d.colwise() += queries.rowwise().squaredNorm();
  return d.cwiseMax(0.0f);
}

struct Blend {
  float a = 0.0f, b = 0.0f;
  float agreement = 0.0f;
};

// Softmax over the nearest, as wide as the best distance says; and how far they spread.
Blend BlendNearest(const std::vector<std::pair<float, int32_t>>& nearest, const CellMatrix& ab) {
  const double width = 0.3 * (static_cast<double>(nearest[0].first) + kDistanceFloor);
  double sum = 0.0, a = 0.0, b = 0.0, squares = 0.0;
  for (const auto& [distance, index] : nearest) {
    const double w = std::exp(-(static_cast<double>(distance) - nearest[0].first) / width);
    sum += w;
    a += w * ab(index, 0);
    b += w * ab(index, 1);
    squares += w * (std::pow(ab(index, 0), 2) + std::pow(ab(index, 1), 2));
  }
  a /= sum;
  b /= sum;
  const double variance = std::max(0.0, squares / sum - a * a - b * b);
  return {static_cast<float>(a),
          static_cast<float>(b),
          static_cast<float>(std::exp(-0.5 * variance / (kAgreementWidth * kAgreementWidth)))};
}

}  // namespace

CellMatches MatchCells(const CellMatrix& queries,
                       const CellBank& bank,
                       int neighbours,
                       double distance_scale,
                       ThreadPool& pool,
                       const CancellationToken& cancel) {
  const Eigen::Index cells = queries.rows(), entries = bank.features.rows();
  const Eigen::RowVectorXf squares = bank.features.rowwise().squaredNorm();
  const int64_t blocks = (cells + kQueriesAtOnce - 1) / kQueriesAtOnce;
  CellMatches matches{CellMatrix(cells, 2), std::vector<float>(cells), std::vector<int32_t>(cells)};
  std::vector<int32_t> best(cells);
  std::vector<float> best_distance(cells);
  std::vector<Eigen::RowVectorXf> nearest_query(
      pool.thread_count(),
      Eigen::RowVectorXf::Constant(entries, std::numeric_limits<float>::infinity()));
  pool.ForEach(blocks, [&](int64_t block, int thread) {
    cancel.ThrowIfCancelled();
    const Eigen::Index begin = block * kQueriesAtOnce;
    const Eigen::Index count = std::min<Eigen::Index>(kQueriesAtOnce, cells - begin);
    const CellMatrix d = Distances(queries.middleRows(begin, count), bank.features, squares);
    nearest_query[thread] = nearest_query[thread].cwiseMin(d.colwise().minCoeff());
    std::vector<std::pair<float, int32_t>> order(entries);
    for (Eigen::Index q = 0; q < count; ++q) {
      for (Eigen::Index k = 0; k < entries; ++k) order[k] = {d(q, k), static_cast<int32_t>(k)};
      const auto end = order.begin() + std::min<Eigen::Index>(neighbours, entries);
      std::partial_sort(order.begin(), end, order.end());
      const Blend blend = BlendNearest({order.begin(), end}, bank.ab);
      matches.ab(begin + q, 0) = blend.a;
      matches.ab(begin + q, 1) = blend.b;
      matches.confidence[begin + q] = blend.agreement;
      best[begin + q] = order[0].second;
      best_distance[begin + q] = order[0].first;
      matches.reference[begin + q] = bank.reference[order[0].second];
    }
  });
  for (size_t t = 1; t < nearest_query.size(); ++t) {
    nearest_query[0] = nearest_query[0].cwiseMin(nearest_query[t]);
  }
  for (Eigen::Index i = 0; i < cells; ++i) {
    const double distance = best_distance[i];
    const double mutual =
        (nearest_query[0](best[i]) + kDistanceFloor) / (distance + kDistanceFloor);
    const double closeness = std::exp(-std::pow(distance / (distance_scale + kDistanceFloor), 2));
    matches.confidence[i] *= static_cast<float>(closeness * std::sqrt(std::min(1.0, mutual)));
  }
  return matches;
}

double DistanceScale(const CellMatrix& sample, const CellMatrix& features) {
  const Eigen::RowVectorXf squares = features.rowwise().squaredNorm();
  const CellMatrix d = Distances(sample, features, squares);
  std::vector<float> nearest, any;
  for (Eigen::Index q = 0; q < d.rows(); ++q) {
    float best = std::numeric_limits<float>::infinity();
    for (Eigen::Index k = 0; k < d.cols(); ++k) {
      // The cell itself is no other.
      if (d(q, k) > 1e-4f) best = std::min(best, d(q, k));
    }
    if (std::isfinite(best)) nearest.push_back(best);
    any.push_back(d(q, (q + d.cols() / 2) % d.cols()));
  }
  if (nearest.empty()) return 1.0;
  const auto median = [](std::vector<float>& values) {
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return static_cast<double>(values[values.size() / 2]);
  };
  return std::sqrt(median(nearest) * median(any));
}

}  // namespace color3d
