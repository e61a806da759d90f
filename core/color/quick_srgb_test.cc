#include "core/color/quick_srgb.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "core/base/image.h"
#include "core/color/lab.h"

namespace color3d {
namespace {

TEST(QuickSrgbTest, IsTheExactColorToOneLevel) {
  // Colours inside and outside of the gamut.
  Image lab(41 * 41, 51, 3);
  for (int y = 0; y < lab.height; ++y) {
    for (int x = 0; x < lab.width; ++x) {
      lab.At(0, y, x) = static_cast<float>(2 * y);
      lab.At(1, y, x) = static_cast<float>(5 * (x % 41) - 100);
      lab.At(2, y, x) = static_cast<float>(5 * (x / 41) - 100);
    }
  }
  const Image exact = SrgbFromLab(lab);
  std::vector<uint8_t> rgb(lab.data.size());
  QuickSrgbFromLab(
      lab.Plane(0), lab.Plane(1), lab.Plane(2), static_cast<int64_t>(lab.PlaneSize()), rgb.data());
  int64_t other = 0;
  for (size_t i = 0; i < lab.PlaneSize(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const int level = static_cast<int>(std::lround(255.0f * exact.Plane(c)[i]));
      const int found = rgb[3 * i + static_cast<size_t>(c)];
      ASSERT_LE(std::abs(found - level), 1) << i << " " << c;
      other += found != level ? 1 : 0;
    }
  }
  EXPECT_LT(other, static_cast<int64_t>(rgb.size() / 200));
}

TEST(QuickSrgbTest, GreyIsGrey) {
  for (float l : {0.0f, 0.5f, 50.0f, 99.9f, 100.0f}) {
    const float none = 0.0f;
    uint8_t rgb[3];
    QuickSrgbFromLab(&l, &none, &none, 1, rgb);
    EXPECT_EQ(rgb[0], rgb[1]) << l;
    EXPECT_EQ(rgb[1], rgb[2]) << l;
    EXPECT_EQ(rgb[0], std::lround(255.0 * GrayFromLuminance(l))) << l;
  }
}

}  // namespace
}  // namespace color3d
