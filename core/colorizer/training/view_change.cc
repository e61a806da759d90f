#include "core/colorizer/training/view_change.h"

#include <torch/types.h>

#include <cmath>
#include <numbers>

namespace color3d {
namespace {

constexpr double kMaxAngle = 15.0 * std::numbers::pi / 180.0;
constexpr double kMaxScale = 1.25;
constexpr double kMaxStretch = 1.15;
constexpr double kMaxShift = 0.1;
constexpr double kMaxLight = 5.0;
constexpr double kMaxContrastChange = 0.1;

double DrawRatio(double largest, Random& random) {
  return std::exp(random.NextUniform(-std::log(largest), std::log(largest)));
}

}  // namespace

AffineMap Inverse(const AffineMap& map) {
  const double determinant = map[0] * map[4] - map[1] * map[3];
  const double xx = map[4] / determinant, xy = -map[1] / determinant;
  const double yx = -map[3] / determinant, yy = map[0] / determinant;
  return {xx, xy, -(xx * map[2] + xy * map[5]), yx, yy, -(yx * map[2] + yy * map[5])};
}

ViewChange ViewChange::Draw(Random& random) {
  ViewChange change;
  change.angle = random.NextUniform(-kMaxAngle, kMaxAngle);
  change.scale = DrawRatio(kMaxScale, random);
  change.stretch = DrawRatio(kMaxStretch, random);
  change.mirrored = random.NextUniform() < 0.5;
  change.shift_x = random.NextUniform(-kMaxShift, kMaxShift);
  change.shift_y = random.NextUniform(-kMaxShift, kMaxShift);
  change.light = random.NextUniform(-kMaxLight, kMaxLight);
  change.contrast = 1.0 + random.NextUniform(-kMaxContrastChange, kMaxContrastChange);
  return change;
}

AffineMap ViewChange::Positions(int64_t height, int64_t width) const {
  // Rotation is about pixels, which are square: a unit of y is height / width units of x.
  const double aspect = static_cast<double>(height) / static_cast<double>(width);
  const double along_x = (mirrored ? -1.0 : 1.0) * scale * std::sqrt(stretch);
  const double along_y = scale / std::sqrt(stretch);
  const double cosine = std::cos(angle), sine = std::sin(angle);
  return {cosine * along_x,
          -sine * along_y * aspect,
          shift_x,
          sine * along_x / aspect,
          cosine * along_y,
          shift_y};
}

torch::Tensor ViewChange::InLight(const torch::Tensor& luminance) const {
  return ((luminance - 50.0) * contrast + (50.0 + light)).clamp(0.0, 100.0);
}

torch::Tensor SamplingGrid(const AffineMap& map, int64_t height, int64_t width) {
  torch::Tensor theta = torch::empty({1, 2, 3}, torch::kFloat32);
  float* values = theta.data_ptr<float>();
  for (size_t i = 0; i < map.size(); ++i) values[i] = static_cast<float>(map[i]);
  return torch::affine_grid_generator(theta, {1, 1, height, width}, /*align_corners=*/false);
}

torch::Tensor Warp(const torch::Tensor& picture, const torch::Tensor& grid, Border border) {
  constexpr int64_t kBilinear = 0;
  const int64_t padding = border == Border::kZero ? 0 : border == Border::kRepeat ? 1 : 2;
  return torch::grid_sampler(picture, grid, kBilinear, padding, /*align_corners=*/false);
}

}  // namespace color3d
