// What a picture looks like in cells of 4 px: encoder features and local luminance statistics.
// Internal to core/keycolor.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/base/image.h"
#include "core/encoder/encoder.h"

namespace color3d {

inline constexpr int kCellPx = 4;

// One row per cell, row by row.
using CellMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct CellFeatures {
  int columns = 0;
  int rows = 0;
  std::vector<CellMatrix> blocks;  // one per tap, fine to coarse, then the luminance statistics
};

CellFeatures DescribeCells(const Encoder& encoder, const Image& luminance);
// Mean of each plane of a picture over its cells: [cells, channels].
CellMatrix CellMeans(const Image& picture);

// Standardises, rotates to leading principal components and whitens each block of `samples`, so
// that a squared distance is a mean over kinds of features with fixed shares.
class Whitening {
 public:
  explicit Whitening(const std::vector<CellMatrix>& samples);
  CellMatrix Apply(const std::vector<CellMatrix>& blocks) const;

 private:
  struct Projection {
    Eigen::RowVectorXf mean;
    Eigen::MatrixXf matrix;
  };
  std::vector<Projection> projections_;
};

}  // namespace color3d
