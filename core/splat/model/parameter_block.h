// Planar Gaussian parameters: row r of Gaussian i is Row(r)[i]. The layout of training and of the
// kernels (one vector register holds one row of 16 Gaussians); GaussianModel is the layout of files
// and interfaces. Gradients and Adam moments have the same shape. A plain value.
#pragma once

#include <cstdint>

#include "core/simd/plane_buffer.h"

namespace color3d {

inline constexpr int kPositionRow = 0;  // 3 rows
inline constexpr int kLogScaleRow = 3;  // 3 rows
inline constexpr int kRotationRow = 6;  // 4 rows: w x y z
inline constexpr int kOpacityRow = 10;  // 1 row: logit
inline constexpr int kColorRow = 11;    // spherical harmonics, channel after channel

class ParameterBlock {
 public:
  ParameterBlock() = default;
  ParameterBlock(int rows, int64_t count) : rows_(rows) { Resize(count); }

  int rows() const { return rows_; }
  int64_t count() const { return count_; }
  int64_t blocks() const { return (count_ + 15) / 16; }  // of 16 Gaussians
  bool HasShapeOf(const ParameterBlock& other) const {
    return rows_ == other.rows_ && count_ == other.count_;
  }
  ParameterBlock ZerosOfSameShape() const { return ParameterBlock(rows_, count_); }
  // A multiple of 16, at least count(). Lanes from count() on are zero.
  int64_t stride() const { return stride_; }
  float* Row(int row) { return values_.data() + row * stride_; }
  const float* Row(int row) const { return values_.data() + row * stride_; }
  const AlignedFloats& values() const { return values_; }

  // Keeps the first min(old, new) Gaussians; new ones are zero.
  void Resize(int64_t count);
  void SetZero();
  // Gaussian i becomes the old Gaussian source[i].
  void Gather(const std::vector<uint32_t>& source);
  // Copies all rows of Gaussian `from` over Gaussian `to`.
  void CopyGaussian(int64_t from, int64_t to);

 private:
  int rows_ = 0;
  int64_t count_ = 0;
  int64_t stride_ = 0;
  AlignedFloats values_;
};

// One colour channel of a picture: value = base + sum over k < coefficients of Y_k(direction) *
// Row(row + k), not below zero when `clamp_at_zero` (as 3DGS).
struct ColorChannel {
  int row = kColorRow;
  int coefficients = 1;  // 1, 4, 9 or 16
  float base = 0.5f;
  bool clamp_at_zero = true;
};
struct ColorSpec {
  int channels = 1;  // 1..3
  ColorChannel channel[3];
};

}  // namespace color3d
