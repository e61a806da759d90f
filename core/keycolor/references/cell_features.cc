#include "core/keycolor/references/cell_features.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/encoder/tap_images.h"

namespace color3d {
namespace {

constexpr std::array<int, 3> kWindowRadii{1, 3, 9};  // in cells
constexpr int64_t kMostDims = 16;                    // kept per block
constexpr double kEigenvalueFloor = 0.02;            // share of the largest eigenvalue
// Shares of the distance: fine taps tell texture, coarse ones tell things.
constexpr std::array<double, 4> kTapWeights{0.3, 0.5, 1.0, 1.0};
constexpr double kLuminanceWeight = 1.0;

// A tap on the grid of cells, bilinear.
CellMatrix OnGrid(const TapImage& tap, int columns, int rows) {
  const Image& f = tap.features;
  CellMatrix matrix(static_cast<Eigen::Index>(columns) * rows, f.channels);
  const float scale = static_cast<float>(kCellPx) / static_cast<float>(tap.stride);
  const auto place = [&](int cell, int count, int& low, int& high, float& share) {
    const float at = std::clamp(
        (static_cast<float>(cell) + 0.5f) * scale - 0.5f, 0.0f, static_cast<float>(count - 1));
    low = static_cast<int>(at);
    high = std::min(low + 1, count - 1);
    share = at - static_cast<float>(low);
  };
  for (int y = 0; y < rows; ++y) {
    int y0, y1;
    float ty;
    place(y, f.height, y0, y1, ty);
    for (int x = 0; x < columns; ++x) {
      int x0, x1;
      float tx;
      place(x, f.width, x0, x1, tx);
      float* out = matrix.row(static_cast<Eigen::Index>(y) * columns + x).data();
      for (int c = 0; c < f.channels; ++c) {
        const float top = (1.0f - tx) * f.At(c, y0, x0) + tx * f.At(c, y0, x1);
        const float bottom = (1.0f - tx) * f.At(c, y1, x0) + tx * f.At(c, y1, x1);
        out[c] = (1.0f - ty) * top + ty * bottom;
      }
    }
  }
  return matrix;
}

// Sums over rectangles of a [rows, columns] grid in constant time.
class SummedArea {
 public:
  SummedArea(const std::vector<double>& values, int columns, int rows)
      : stride_(columns + 1), sums_(static_cast<size_t>(columns + 1) * (rows + 1), 0.0) {
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x) {
        At(x + 1, y + 1) =
            values[static_cast<size_t>(y) * columns + x] + At(x, y + 1) + At(x + 1, y) - At(x, y);
      }
    }
  }
  double Sum(int x0, int y0, int x1, int y1) {
    return At(x1, y1) - At(x0, y1) - At(x1, y0) + At(x0, y0);
  }

 private:
  double& At(int x, int y) { return sums_[static_cast<size_t>(y) * stride_ + x]; }
  int stride_;
  std::vector<double> sums_;
};

// L, and its mean and deviation in windows of cells: what normalised encoder features have lost.
CellMatrix LuminanceStatistics(const Image& luminance, int columns, int rows) {
  Image squared = luminance;
  for (size_t i = 0; i < squared.data.size(); ++i) {
    squared.data[i] = luminance.data[i] * luminance.data[i] * 1e-4f;
  }
  const CellMatrix l = CellMeans(luminance) * 0.01f, ll = CellMeans(squared);
  SummedArea sum({l.data(), l.data() + l.size()}, columns, rows);
  SummedArea squares({ll.data(), ll.data() + ll.size()}, columns, rows);
  CellMatrix matrix(l.rows(), 1 + 2 * kWindowRadii.size());
  matrix.col(0) = l;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const Eigen::Index i = static_cast<Eigen::Index>(y) * columns + x;
      for (size_t k = 0; k < kWindowRadii.size(); ++k) {
        const int r = kWindowRadii[k];
        const int x0 = std::max(0, x - r), x1 = std::min(columns, x + r + 1);
        const int y0 = std::max(0, y - r), y1 = std::min(rows, y + r + 1);
        const double area = static_cast<double>(x1 - x0) * (y1 - y0);
        const double mean = sum.Sum(x0, y0, x1, y1) / area;
        const double variance = std::max(0.0, squares.Sum(x0, y0, x1, y1) / area - mean * mean);
        matrix(i, 1 + 2 * k) = static_cast<float>(mean);
        matrix(i, 2 + 2 * k) = static_cast<float>(std::sqrt(variance + 1e-5));
      }
    }
  }
  return matrix;
}

}  // namespace

CellMatrix CellMeans(const Image& picture) {
  const int columns = (picture.width + kCellPx - 1) / kCellPx;
  const int rows = (picture.height + kCellPx - 1) / kCellPx;
  CellMatrix means(static_cast<Eigen::Index>(columns) * rows, picture.channels);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const int x1 = std::min(picture.width, (x + 1) * kCellPx);
      const int y1 = std::min(picture.height, (y + 1) * kCellPx);
      const auto area = static_cast<float>((x1 - x * kCellPx) * (y1 - y * kCellPx));
      for (int c = 0; c < picture.channels; ++c) {
        float sum = 0.0f;
        for (int v = y * kCellPx; v < y1; ++v) {
          for (int u = x * kCellPx; u < x1; ++u) sum += picture.At(c, v, u);
        }
        means(static_cast<Eigen::Index>(y) * columns + x, c) = sum / area;
      }
    }
  }
  return means;
}

CellFeatures DescribeCells(const Encoder& encoder, const Image& luminance) {
  CellFeatures cells;
  cells.columns = (luminance.width + kCellPx - 1) / kCellPx;
  cells.rows = (luminance.height + kCellPx - 1) / kCellPx;
  for (const TapImage& tap : TapImages(encoder, luminance)) {
    cells.blocks.push_back(OnGrid(tap, cells.columns, cells.rows));
  }
  cells.blocks.push_back(LuminanceStatistics(luminance, cells.columns, cells.rows));
  return cells;
}

Whitening::Whitening(const std::vector<CellMatrix>& samples) {
  for (size_t k = 0; k < samples.size(); ++k) {
    const bool is_tap = k + 1 < samples.size();
    const double weight =
        is_tap ? kTapWeights[std::min(k, kTapWeights.size() - 1)] : kLuminanceWeight;
    const Eigen::MatrixXd x = samples[k].cast<double>();
    const Eigen::RowVectorXd mean = x.colwise().mean();
    const Eigen::MatrixXd centered = x.rowwise() - mean;
    const auto count = static_cast<double>(x.rows());
    const Eigen::RowVectorXd inverse_deviation =
        (centered.array().square().colwise().sum() / count + 1e-8).rsqrt();
    const Eigen::MatrixXd standard = centered.array().rowwise() * inverse_deviation.array();
    const Eigen::MatrixXd covariance = standard.transpose() * standard / count;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
    const Eigen::Index dims = std::min<Eigen::Index>(kMostDims, x.cols());
    const Eigen::VectorXd values = solver.eigenvalues().tail(dims).cwiseMax(0.0);
    const double floor = kEigenvalueFloor * values.maxCoeff() + 1e-12;
    const Eigen::VectorXd scale =
        (weight / static_cast<double>(dims) / (values.array() + floor)).sqrt();
    const Eigen::MatrixXd matrix = inverse_deviation.transpose().asDiagonal() *
                                   solver.eigenvectors().rightCols(dims) * scale.asDiagonal();
    projections_.push_back({mean.cast<float>(), matrix.cast<float>()});
  }
}

CellMatrix Whitening::Apply(const std::vector<CellMatrix>& blocks) const {
  Eigen::Index columns = 0;
  for (const Projection& projection : projections_) columns += projection.matrix.cols();
  CellMatrix features(blocks[0].rows(), columns);
  Eigen::Index column = 0;
  for (size_t k = 0; k < blocks.size(); ++k) {
    const Projection& p = projections_[k];
    features.middleCols(column, p.matrix.cols()) = (blocks[k].rowwise() - p.mean) * p.matrix;
    column += p.matrix.cols();
  }
  return features;
}

}  // namespace color3d
