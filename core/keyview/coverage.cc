#include "core/keyview/coverage.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/base/parallel.h"

namespace color3d {
namespace {

constexpr int kMaxComponents = 32;
// Multiply-adds of all products together; sets how many cells of each view take part.
constexpr double kWorkBudget = 2e10;
constexpr int kMinCells = 48;
constexpr int kMaxCells = 400;

int CellsPerView(size_t views, int dims) {
  const double pairs = static_cast<double>(views) * static_cast<double>(views);
  const double cells = std::sqrt(kWorkBudget / (pairs * dims));
  return std::clamp(static_cast<int>(cells), kMinCells, kMaxCells);
}

// One column per taken cell; cells are taken at even steps through the grid.
Eigen::MatrixXf TakeCells(const Image& features, int wanted) {
  const int64_t available = static_cast<int64_t>(features.PlaneSize());
  const int64_t taken = std::min<int64_t>(available, wanted);
  Eigen::MatrixXf cells(features.channels, taken);
  for (int64_t i = 0; i < taken; ++i) {
    const int64_t cell = (2 * i + 1) * available / (2 * taken);
    for (int c = 0; c < features.channels; ++c) {
      const float value = features.Plane(c)[cell];
      cells(c, i) = std::isfinite(value) ? value : 0.0f;
    }
  }
  return cells;
}

// Standardises all views together and projects onto the leading principal components. Distances are
// afterwards root mean squares per channel of the standardised features.
void Project(std::vector<Eigen::MatrixXf>& views) {
  const Eigen::Index channels = views[0].rows();
  double count = 0.0;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(channels);
  for (const auto& view : views) {
    mean += view.cast<double>().rowwise().sum();
    count += static_cast<double>(view.cols());
  }
  mean /= count;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(channels, channels);
  for (const auto& view : views) {
    const Eigen::MatrixXd centred = view.cast<double>().colwise() - mean;
    covariance += centred * centred.transpose();
  }
  covariance /= count;
  // A channel that never changes carries nothing and must not be blown up.
  const double floor = 1e-12 + 1e-9 * covariance.diagonal().maxCoeff();
  const Eigen::VectorXd scale = (covariance.diagonal().array() > floor)
                                    .select(covariance.diagonal().array().max(floor).rsqrt(), 0.0)
                                    .matrix() /
                                std::sqrt(static_cast<double>(channels));
  covariance = scale.asDiagonal() * covariance * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  const Eigen::Index kept = std::min<Eigen::Index>(channels, kMaxComponents);
  const Eigen::MatrixXf projection =
      (solver.eigenvectors().rightCols(kept).transpose() * scale.asDiagonal()).cast<float>();
  const Eigen::VectorXf offset = projection * mean.cast<float>();
  for (auto& view : views) view = ((projection * view).colwise() - offset).eval();
}

// Mean over the columns of `to` of the distance to the nearest column of `from`.
double MeanNearest(const Eigen::MatrixXf& from,
                   const Eigen::VectorXf& from_squares,
                   const Eigen::MatrixXf& to,
                   const Eigen::VectorXf& to_squares) {
  Eigen::MatrixXf distances = -2.0f * from.transpose() * to;
  distances.colwise() += from_squares;
  double sum = 0.0;
  for (Eigen::Index j = 0; j < to.cols(); ++j) {
    sum += std::sqrt(std::max(0.0f, distances.col(j).minCoeff() + to_squares[j]));
  }
  return sum / static_cast<double>(to.cols());
}

}  // namespace

std::vector<std::vector<double>> FeatureDistances(const std::vector<Image>& deep_features,
                                                  ProgressObserver& progress,
                                                  const CancellationToken& cancel) {
  const size_t n = deep_features.size();
  if (n == 0) throw InvalidArgument("coverage needs at least one view");
  const int channels = deep_features[0].channels;
  for (const Image& features : deep_features) {
    if (features.Empty() || features.channels != channels) {
      throw InvalidArgument("coverage needs features with one channel count for every view, got " +
                            std::to_string(channels) + " and " + std::to_string(features.channels));
    }
  }
  const int cells = CellsPerView(n, std::min(channels, kMaxComponents));
  std::vector<Eigen::MatrixXf> views;
  for (const Image& features : deep_features) views.push_back(TakeCells(features, cells));
  Project(views);
  std::vector<Eigen::VectorXf> squares;
  for (const auto& view : views) squares.push_back(view.colwise().squaredNorm().transpose());
  std::vector<std::vector<double>> distance(n, std::vector<double>(n, 0.0));
  ThreadPool pool;
  for (size_t i = 0; i < n; ++i) {
    cancel.ThrowIfCancelled();
    pool.ForEach(static_cast<int64_t>(n), [&](int64_t j, int) {
      if (static_cast<size_t>(j) == i) return;
      distance[i][j] = MeanNearest(views[i], squares[i], views[j], squares[j]);
    });
    progress.OnProgress(static_cast<int64_t>(i) + 1, static_cast<int64_t>(n), "comparing views");
  }
  return distance;
}

}  // namespace color3d
