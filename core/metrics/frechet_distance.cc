#include "core/metrics/frechet_distance.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "core/base/error.h"

namespace color3d {
namespace {

using Rows = std::vector<std::vector<float>>;

// Mean and deviations A from it, scaled so that the covariance is A^T A.
struct Moments {
  Eigen::VectorXd mean;
  Eigen::MatrixXd deviations;
};

Moments MomentsOf(const Rows& rows, size_t width) {
  if (rows.size() < 2 || width == 0) {
    throw InvalidArgument(
        "the Fréchet distance needs sets of at least 2 samples with features, got {} samples of {}",
        rows.size(),
        width);
  }
  Eigen::MatrixXd samples(rows.size(), width);
  for (size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].size() != width) {
      throw InvalidArgument(
          "sample {} has {} features, the first one has {}", i, rows[i].size(), width);
    }
    for (size_t k = 0; k < width; ++k) samples(i, k) = rows[i][k];
  }
  if (!samples.allFinite()) throw InvalidArgument("features of a picture are not finite");
  Moments moments;
  moments.mean = samples.colwise().mean().transpose();
  samples.rowwise() -= moments.mean.transpose();
  moments.deviations = samples / std::sqrt(static_cast<double>(rows.size() - 1));
  return moments;
}

Eigen::VectorXd RootsOf(const Eigen::VectorXd& eigenvalues) {
  return eigenvalues.cwiseMax(0.0).cwiseSqrt();  // rounding makes zeros negative
}

// tr (C1^1/2 C2 C1^1/2)^1/2 by symmetric roots.
double RootTraceOfCovariances(const Eigen::MatrixXd& c1, const Eigen::MatrixXd& c2) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> first(c1);
  const Eigen::MatrixXd root = first.eigenvectors() * RootsOf(first.eigenvalues()).asDiagonal() *
                               first.eigenvectors().transpose();
  const Eigen::MatrixXd product = root * c2 * root;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> second(product, Eigen::EigenvaluesOnly);
  return RootsOf(second.eigenvalues()).sum();
}

// The same for C1 = A^T A and C2 = B^T B with few rows: C1 C2 has the non-zero eigenvalues of
// (A B^T)^T (A B^T), so that the trace is the sum of the singular values of A B^T.
double RootTraceOfDeviations(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const Eigen::MatrixXd product = a * b.transpose();
  return Eigen::BDCSVD<Eigen::MatrixXd>(product).singularValues().sum();
}

}  // namespace

double FrechetDistance(const Rows& first, const Rows& second) {
  const size_t width = first.empty() ? 0 : first[0].size();
  const Moments m1 = MomentsOf(first, width), m2 = MomentsOf(second, width);
  const Eigen::MatrixXd &a = m1.deviations, &b = m2.deviations;
  const bool few = std::max(first.size(), second.size()) <= width;
  const double root_trace = few ? RootTraceOfDeviations(a, b)
                                : RootTraceOfCovariances(a.transpose() * a, b.transpose() * b);
  const double distance =
      (m1.mean - m2.mean).squaredNorm() + a.squaredNorm() + b.squaredNorm() - 2.0 * root_trace;
  return std::max(0.0, distance);
}

}  // namespace color3d
