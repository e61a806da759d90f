#include "core/scene/cubic_remap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/random.h"
#include "core/simd/instruction_set.h"

namespace color3d {
namespace {

double Keys(double x) {
  const double t = std::abs(x);
  if (t < 1.0) return 1.5 * t * t * t - 2.5 * t * t + 1.0;
  if (t < 2.0) return -0.5 * t * t * t + 2.5 * t * t - 4.0 * t + 2.0;
  return 0.0;
}

// The convolution of the picture, continued beyond its borders, with the kernel.
double Sample(const Image& image, int channel, double x, double y) {
  x = std::clamp(x, -1.0, static_cast<double>(image.width));
  y = std::clamp(y, -1.0, static_cast<double>(image.height));
  double sum = 0.0;
  for (int r = -4; r < image.height + 4; ++r) {
    for (int c = -4; c < image.width + 4; ++c) {
      sum +=
          Keys(x - c) * Keys(y - r) *
          image.At(channel, std::clamp(r, 0, image.height - 1), std::clamp(c, 0, image.width - 1));
    }
  }
  return sum;
}

// 7 x 5 results: one whole register of AVX-512 at most, and a rest for every instruction set.
TEST(CubicRemap, IsKeysConvolutionForEveryInstructionSet) {
  Random random(3, 0);
  Image image(9, 6, 3);
  for (float& value : image.data) value = random.NextUniform();
  RemapTable table{7, 5, {}, {}};
  for (int i = 0; i < table.width * table.height; ++i) {
    table.x.push_back(-3.0f + 15.0f * random.NextUniform());
    table.y.push_back(-3.0f + 12.0f * random.NextUniform());
  }
  for (const std::string& set : SupportedInstructionSets()) {
    LimitInstructionSet(set);
    const Image out = CubicRemap(image, table);
    for (int c = 0; c < image.channels; ++c) {
      const auto [low, high] =
          std::minmax_element(image.Plane(c), image.Plane(c) + image.PlaneSize());
      for (size_t i = 0; i < table.x.size(); ++i) {
        const double expected =
            std::clamp<double>(Sample(image, c, table.x[i], table.y[i]), *low, *high);
        EXPECT_NEAR(out.Plane(c)[i], expected, 2e-6) << set;
      }
    }
  }
  LimitInstructionSet("");
}

}  // namespace
}  // namespace color3d
