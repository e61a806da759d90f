// The image loss of constant, black, white and tiny pictures, where SSIM's variances cancel.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "core/base/random.h"
#include "core/splat/training/loss.h"
#include "tests/reference/splat.h"
#include "tests/stability/stability_case.h"

namespace color3d {
namespace {

using Planes = std::vector<std::vector<double>>;
using Pixel = std::function<double(int channel, int row, int column)>;

constexpr int kProbes = 32;     // pixels whose gradient is checked
constexpr double kStep = 1e-6;  // of the finite differences, in float64

Pixel Constant(double value) {
  return [value](int, int, int) { return value; };
}
Pixel Textured(uint64_t seed) {
  return [seed](int c, int y, int x) {
    Random random(seed + static_cast<uint64_t>((c * 8192 + y) * 8192 + x));
    return 0.5 + 0.3 * std::sin(0.3 * x + static_cast<double>(seed)) * std::cos(0.2 * y) +
           random.NextUniform(-0.15, 0.15);
  };
}
Pixel OnePixel(double background, double value, int row, int column) {
  return [=](int, int y, int x) { return y == row && x == column ? value : background; };
}

struct LossCase {
  int width, height, channels;
  Pixel x, y;
  LossWeights weights;
};

PlaneBuffer Draw(const LossCase& l, const Pixel& pixel) {
  PlaneBuffer p(l.width, l.height, l.channels);
  for (int c = 0; c < l.channels; ++c) {
    for (int y = 0; y < l.height; ++y) {
      for (int x = 0; x < l.width; ++x) p.Row(c, y)[x] = static_cast<float>(pixel(c, y, x));
    }
  }
  return p;
}

Planes ToPlanes(const PlaneBuffer& p) {
  Planes planes;
  for (int c = 0; c < p.channels; ++c) {
    planes.emplace_back();
    for (int y = 0; y < p.height; ++y) {
      planes.back().insert(planes.back().end(), p.Row(c, y), p.Row(c, y) + p.width);
    }
  }
  return planes;
}

// The variance in SSIM's denominator is a difference of squares: rounding of the squares, eps x^2,
// stands against C2.
double SsimCondition(const PlaneBuffer& x, const PlaneBuffer& y) {
  double largest = 0.0;
  for (const PlaneBuffer* p : {&x, &y}) {
    for (const float v : p->data) largest = std::max(largest, static_cast<double>(v) * v);
  }
  return std::max(1.0, 2.0 * largest / kSsimC2);
}

// Central differences of the float64 loss at some pixels, corners first. The scale is the largest
// one, and at least the weight of SSIM on a pixel, since between equal pictures all vanish.
double GradientError(const LossCase& l, Planes x, const Planes& y, const PlaneBuffer& gradient) {
  Random random(7);
  double worst = 0.0;
  double scale = l.weights.ssim / (static_cast<double>(l.width) * l.height * l.channels);
  for (int trial = 0; trial < kProbes; ++trial) {
    const int c = static_cast<int>(random.NextBelow(l.channels));
    const int row = trial < 4    ? trial / 2 * (l.height - 1)
                    : trial == 4 ? l.height / 2
                                 : static_cast<int>(random.NextBelow(l.height));
    const int column = trial < 4    ? trial % 2 * (l.width - 1)
                       : trial == 4 ? l.width / 2
                                    : static_cast<int>(random.NextBelow(l.width));
    double& pixel = x[c][static_cast<size_t>(row) * l.width + column];
    const double saved = pixel;
    double loss[2];
    for (int side = 0; side < 2; ++side) {
      pixel = saved + (side == 0 ? kStep : -kStep);
      loss[side] = ReferenceLoss(x, y, {}, l.width, l.height, l.weights);
    }
    pixel = saved;
    const double expected = (loss[0] - loss[1]) / (2.0 * kStep);
    worst = std::max(worst, std::abs(gradient.Row(c, row)[column] - expected));
    scale = std::max(scale, std::abs(expected));
  }
  return worst / scale;
}

StabilityResult Run(const LossCase& l, ThreadPool& pool) {
  const PlaneBuffer x = Draw(l, l.x), y = Draw(l, l.y);
  ImageLoss loss;
  PlaneBuffer gradient;
  const LossValue value = loss.Evaluate(x, y, nullptr, l.weights, pool, gradient);
  StabilityResult result;
  result.condition = SsimCondition(x, y);
  result.condition_of = "2 x^2 / C2 of SSIM";
  result.compared = static_cast<int64_t>(l.width) * l.height * l.channels;
  result.non_finite = CountNonFinite(gradient.data.data(), gradient.data.size()) +
                      (std::isfinite(value.total) ? 0 : 1);
  const double expected = ReferenceLoss(ToPlanes(x), ToPlanes(y), {}, l.width, l.height, l.weights);
  // 1 - SSIM of equal pictures is a difference of numbers near 1, times its weight.
  result.value_error = std::abs(value.total - expected) /
                       std::max(std::abs(expected), static_cast<double>(l.weights.ssim));
  result.value_bound = std::clamp(kFloatEpsilon * result.condition, 1e-5, 1.0);
  result.gradient_error = GradientError(l, ToPlanes(x), ToPlanes(y), gradient);
  result.gradient_bound = std::clamp(kFloatEpsilon * result.condition, 1e-3, 1.0);
  return result;
}

}  // namespace

void AddLossCases(std::vector<StabilityCase>& cases) {
  const auto add = [&](const std::string& name, LossCase l) {
    cases.push_back({"loss", name, false, [l](ThreadPool& pool) { return Run(l, pool); }});
  };
  for (const int channels : {1, 2, 3, 4}) {
    add(fmt::format("textured, {} channels", channels),
        {33, 21, channels, Textured(1), Textured(2), {}});
  }
  add("picture of 1x1 px", {1, 1, 1, Constant(0.3), Constant(0.8), {}});
  add("picture of 2x2 px", {2, 2, 1, Textured(1), Textured(2), {}});
  add("picture of 17x5 px", {17, 5, 1, Textured(1), Textured(2), {}});
  add("picture of 8192x2 px", {8192, 2, 1, Textured(1), Textured(2), {}});
  add("constant against itself", {32, 32, 1, Constant(0.7), Constant(0.7), {}});
  add("constant against texture", {32, 32, 1, Constant(0.7), Textured(1), {}});
  add("constants that differ", {32, 32, 1, Constant(0.2), Constant(0.9), {}});
  add("constants 1e-5 apart", {32, 32, 1, Constant(0.7), Constant(0.7 + 1e-5), {}});
  add("black against black", {32, 32, 1, Constant(0.0), Constant(0.0), {}});
  add("black against white", {32, 32, 1, Constant(0.0), Constant(1.0), {}});
  add("white against white", {32, 32, 1, Constant(1.0), Constant(1.0), {}});
  add("one white pixel on black", {31, 31, 1, OnePixel(0.0, 1.0, 15, 15), Constant(0.0), {}});
  add("one black pixel on white", {31, 31, 1, OnePixel(1.0, 0.0, 15, 15), Constant(1.0), {}});
  add("values of 1e3", {24, 24, 1, Constant(1e3), Textured(1), {}});
  add("SSIM alone on flat chroma", {32, 32, 2, Textured(1), Constant(0.5), {0.0f, 1.0f, 0.0f}});
}

}  // namespace color3d
