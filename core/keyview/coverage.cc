#include "core/keyview/coverage.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kMaxComponents = 32;
// Maximum number of multiply-adds, of all products and of the covariance.
constexpr double kWorkBudget = 2e10;
constexpr double kCovarianceBudget = 4e9;
// Total number of queries over all views: enough for the mean of each view.
constexpr int kQueries = 8000;
constexpr int kMinQueriesPerView = 3;
constexpr int kMinBankCells = 48;
// Queries per matrix product, so that distances stay in the cache.
constexpr int kBatch = 256;

struct CellCounts {
  int bank = 0;     // cells per explaining view
  int queries = 0;  // queries per explained view
};

CellCounts CountsFor(size_t views, int dims) {
  const double n = static_cast<double>(views);
  const int queries =
      std::clamp(static_cast<int>(kQueries / n), kMinQueriesPerView, ViewFeatures::kMaxCells);
  const double bank = kWorkBudget / (n * n * queries * dims);
  return {static_cast<int>(std::clamp<double>(bank, kMinBankCells, ViewFeatures::kMaxCells)),
          queries};
}

// One column per cell, for the first `count` cells.
Eigen::MatrixXf Cells(const ViewFeatures& view, int count) {
  Eigen::MatrixXf cells(view.channels, std::min(count, view.Cells()));
  for (Eigen::Index i = 0; i < cells.size(); ++i) {
    cells.data()[i] =
        Eigen::half_impl::half_to_float(Eigen::half_impl::raw_uint16_to_half(view.deep[i]));
  }
  return cells;
}

// Standardises all views together and projects onto the leading principal components. Resulting
// distances are root mean squares per channel of the standardised features.
struct Projection {
  Eigen::MatrixXf matrix;
  Eigen::VectorXf offset;

  Eigen::MatrixXf Apply(const Eigen::MatrixXf& cells) const {
    return (matrix * cells).colwise() - offset;
  }
};

Projection FitProjection(const std::vector<const ViewFeatures*>& views, int cells_per_view) {
  const Eigen::Index channels = views[0]->channels;
  const double affordable =
      kCovarianceBudget / (static_cast<double>(channels * channels) * views.size());
  const int taken = std::clamp(static_cast<int>(affordable), 4, cells_per_view);
  double count = 0.0;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(channels);
  for (const ViewFeatures* view : views) {
    const Eigen::MatrixXf cells = Cells(*view, taken);
    mean += cells.cast<double>().rowwise().sum();
    count += static_cast<double>(cells.cols());
  }
  mean /= count;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(channels, channels);
  for (const ViewFeatures* view : views) {
    const Eigen::MatrixXd centered = Cells(*view, taken).cast<double>().colwise() - mean;
    covariance.selfadjointView<Eigen::Lower>().rankUpdate(centered);
  }
  covariance = Eigen::MatrixXd(covariance.selfadjointView<Eigen::Lower>()) / count;
  // A constant channel has no information and must not be amplified.
  const double floor = 1e-12 + 1e-9 * covariance.diagonal().maxCoeff();
  const Eigen::VectorXd scale = (covariance.diagonal().array() > floor)
                                    .select(covariance.diagonal().array().max(floor).rsqrt(), 0.0)
                                    .matrix() /
                                std::sqrt(static_cast<double>(channels));
  covariance = scale.asDiagonal() * covariance * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  const Eigen::Index kept = std::min<Eigen::Index>(channels, kMaxComponents);
  Projection projection;
  projection.matrix =
      (solver.eigenvectors().rightCols(kept).transpose() * scale.asDiagonal()).cast<float>();
  projection.offset = projection.matrix * mean.cast<float>();
  return projection;
}

// Query cells: `owner[q]` is the view of column q. Each view has the same total weight.
struct Queries {
  Eigen::MatrixXf cells;
  Eigen::VectorXf squares;
  std::vector<int> owner;
  std::vector<double> weight;
};

Queries GatherQueries(const std::vector<Eigen::MatrixXf>& cells, int per_view) {
  Eigen::Index total = 0;
  for (const auto& view : cells) total += std::min<Eigen::Index>(per_view, view.cols());
  Queries queries;
  queries.cells.resize(cells[0].rows(), total);
  Eigen::Index column = 0;
  for (size_t i = 0; i < cells.size(); ++i) {
    const Eigen::Index count = std::min<Eigen::Index>(per_view, cells[i].cols());
    queries.cells.middleCols(column, count) = cells[i].leftCols(count);
    queries.owner.insert(queries.owner.end(), count, static_cast<int>(i));
    queries.weight.insert(queries.weight.end(), count, 1.0 / static_cast<double>(count));
    column += count;
  }
  queries.squares = queries.cells.colwise().squaredNorm().transpose();
  return queries;
}

// Distance from each query to the nearest column of `bank`.
std::vector<float> Nearest(const Eigen::MatrixXf& bank, const Queries& queries) {
  const Eigen::VectorXf bank_squares = bank.colwise().squaredNorm().transpose();
  const Eigen::MatrixXf minus_two_bank = -2.0f * bank.transpose();
  std::vector<float> nearest(queries.owner.size());
  for (Eigen::Index begin = 0; begin < queries.cells.cols(); begin += kBatch) {
    const Eigen::Index count = std::min<Eigen::Index>(kBatch, queries.cells.cols() - begin);
    Eigen::MatrixXf distances = minus_two_bank * queries.cells.middleCols(begin, count);
    distances.colwise() += bank_squares;
    for (Eigen::Index j = 0; j < count; ++j) {
      const float squared = distances.col(j).minCoeff() + queries.squares[begin + j];
      nearest[static_cast<size_t>(begin + j)] = std::sqrt(std::max(0.0f, squared));
    }
  }
  return nearest;
}

std::vector<const ViewFeatures*> KeptViews(const std::vector<ViewFeatures>& views,
                                           const std::vector<bool>& kept,
                                           std::vector<int>* indices) {
  std::vector<const ViewFeatures*> chosen;
  for (size_t i = 0; i < views.size(); ++i) {
    if (!kept.at(i)) continue;
    chosen.push_back(&views[i]);
    indices->push_back(static_cast<int>(i));
    if (views[i].Cells() > 0 && views[i].channels == chosen[0]->channels) continue;
    throw InvalidArgument(
        "coverage needs features with one channel count for every view, got {} and {}",
        chosen[0]->channels,
        views[i].channels);
  }
  if (chosen.empty()) throw InvalidArgument("coverage needs at least one view");
  return chosen;
}

}  // namespace

int CellsForCoverage(size_t views, int channels) {
  const CellCounts counts =
      CountsFor(std::max<size_t>(views, 1), std::min(channels, kMaxComponents));
  return std::max(counts.bank, counts.queries);
}

NearestDistances FindNearestDistances(const std::vector<ViewFeatures>& views,
                                      const std::vector<bool>& kept,
                                      const RunControl& run) {
  std::vector<int> indices;
  const std::vector<const ViewFeatures*> chosen = KeptViews(views, kept, &indices);
  const int64_t n = static_cast<int64_t>(chosen.size());
  const CellCounts counts = CountsFor(chosen.size(), std::min(chosen[0]->channels, kMaxComponents));
  const int taken = std::max(counts.bank, counts.queries);
  run.cancel.ThrowIfCancelled();
  const Projection projection = FitProjection(chosen, taken);
  std::vector<Eigen::MatrixXf> cells(chosen.size());
  run.pool.ForEach(n,
                   [&](int64_t i, int) { cells[i] = projection.Apply(Cells(*chosen[i], taken)); });
  const Queries queries = GatherQueries(cells, counts.queries);
  NearestDistances result;
  result.weight = queries.weight;
  for (const int owner : queries.owner) result.owner.push_back(indices[owner]);
  result.from.resize(views.size());
  // In rounds, so that cancellation and progress stay on the calling thread.
  const int64_t round = 4 * run.pool.thread_count();
  for (int64_t begin = 0; begin < n; begin += round) {
    run.cancel.ThrowIfCancelled();
    run.pool.ForEach(std::min(round, n - begin), [&](int64_t k, int) {
      const int64_t i = begin + k;
      const Eigen::Index bank = std::min<Eigen::Index>(counts.bank, cells[i].cols());
      result.from[indices[i]] = Nearest(cells[i].leftCols(bank), queries);
    });
    run.progress.OnProgress(std::min(n, begin + round), n, "comparing views");
  }
  return result;
}

std::vector<double> MeanFeatureDistances(const std::vector<ViewFeatures>& views,
                                         const std::vector<bool>& kept,
                                         const RunControl& run) {
  const NearestDistances nearest = FindNearestDistances(views, kept, run);
  const auto count = std::count(kept.begin(), kept.end(), true);
  std::vector<double> means(views.size(), 0.0);
  for (size_t i = 0; i < views.size() && count > 1; ++i) {
    for (size_t q = 0; q < nearest.from[i].size(); ++q) {
      if (nearest.owner[q] != static_cast<int>(i)) {
        means[i] += nearest.weight[q] * nearest.from[i][q];
      }
    }
    means[i] /= static_cast<double>(count - 1);
  }
  return means;
}

}  // namespace color3d
