#include "core/splat/training/hexplane_penalties.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/base/random.h"

namespace color3d {
namespace {

HexPlaneShape SmallShape() {
  HexPlaneShape shape;
  shape.low = {-1.0f, -1.0f, -1.0f};
  shape.high = {1.0f, 1.0f, 1.0f};
  shape.levels = {{3, 5}, {4, 2}};
  return shape;
}

// In float64, sample by sample.
double ReferencePenalty(const HexPlaneShape& shape,
                        const HexPlaneTuning& tuning,
                        const std::vector<double>& planes) {
  double total = 0.0;
  for (int level = 0; level < static_cast<int>(shape.levels.size()); ++level) {
    for (int plane = 0; plane < kHexPlanes; ++plane) {
      const int a = shape.Samples(level, kHexPlaneAxes[plane][0]);
      const int b = shape.Samples(level, kHexPlaneAxes[plane][1]);
      const bool with_time = kHexPlaneAxes[plane][1] == kTimeAxis;
      const auto at = [&](int i, int j, int f) {
        return planes[shape.PlaneBegin(level, plane) +
                      static_cast<size_t>((j * a + i) * shape.features + f)];
      };
      double sum = 0.0;
      for (int j = 0; j < b; ++j) {
        for (int i = 0; i < a; ++i) {
          for (int f = 0; f < shape.features; ++f) {
            const double v = at(i, j, f);
            if (with_time) {
              sum += tuning.time_change * std::abs(v - 1.0);
              if (j > 0 && j + 1 < b) {
                sum +=
                    tuning.smoothness * std::pow(at(i, j + 1, f) - 2.0 * v + at(i, j - 1, f), 2.0);
              }
            } else {
              if (i + 1 < a) sum += tuning.variation * std::pow(at(i + 1, j, f) - v, 2.0);
              if (j + 1 < b) sum += tuning.variation * std::pow(at(i, j + 1, f) - v, 2.0);
            }
          }
        }
      }
      total += sum / (static_cast<double>(a) * b * shape.features);
    }
  }
  return total;
}

TEST(HexPlanePenaltiesTest, ValueAndGradientAgreeWithFloat64) {
  const HexPlaneShape shape = SmallShape();
  HexPlaneTuning tuning;
  tuning.variation = 2.0;
  tuning.smoothness = 3.0;
  tuning.time_change = 0.7;
  Random random(3);
  std::vector<float> planes;
  for (size_t i = 0; i < shape.PlaneFloats(); ++i) {
    planes.push_back(static_cast<float>(random.NextUniform(0.2, 1.8)));
  }
  const std::vector<double> exact(planes.begin(), planes.end());
  ThreadPool pool(2);
  std::vector<float> gradient(planes.size(), 0.25f);  // it is added to
  const double value = AddPlanePenalties(shape, tuning, planes.data(), pool, gradient.data());
  EXPECT_NEAR(value, ReferencePenalty(shape, tuning, exact), 1e-5 * value);
  constexpr double kStep = 1e-5;
  for (size_t i = 0; i < planes.size(); i += 5) {
    std::vector<double> up = exact, down = exact;
    up[i] += kStep;
    down[i] -= kStep;
    const double expected =
        0.25 + (ReferencePenalty(shape, tuning, up) - ReferencePenalty(shape, tuning, down)) /
                   (2.0 * kStep);
    EXPECT_NEAR(gradient[i], expected, 1e-4) << i;
  }
}

TEST(HexPlanePenaltiesTest, VanishForConstantPlanesOfOne) {
  const HexPlaneShape shape = SmallShape();
  const std::vector<float> planes(shape.PlaneFloats(), 1.0f);
  std::vector<float> gradient(planes.size(), 0.0f);
  ThreadPool pool(1);
  EXPECT_EQ(AddPlanePenalties(shape, HexPlaneTuning(), planes.data(), pool, gradient.data()), 0.0);
  for (const float g : gradient) EXPECT_EQ(g, 0.0f);
}

}  // namespace
}  // namespace color3d
