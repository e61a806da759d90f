#include "core/image/quick_png.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

std::vector<uint8_t> Wave(int width, int height) {
  std::vector<uint8_t> rgb;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        rgb.push_back(static_cast<uint8_t>(128 + 100 * std::sin(0.03 * x * (c + 1) + 0.07 * y)));
      }
    }
  }
  return rgb;
}

TEST(QuickPngTest, IsReadAsItWas) {
  ThreadPool pool(2);
  for (const auto& [width, height] : {std::pair{1, 1}, {3, 64}, {150, 65}, {201, 300}}) {
    const std::vector<uint8_t> rgb = Wave(width, height);
    const std::string png = EncodeQuickPng(rgb, width, height, pool);
    const Image read = DecodeImage(png, "the picture");
    ASSERT_EQ(read.width, width);
    ASSERT_EQ(read.height, height);
    for (size_t i = 0; i < read.PlaneSize(); ++i) {
      for (int c = 0; c < 3; ++c) {
        const int level =
            static_cast<int>(std::lround(255.0f * read.Plane(read.channels == 3 ? c : 0)[i]));
        ASSERT_EQ(level, rgb[3 * i + static_cast<size_t>(c)]) << i;
      }
    }
    ThreadPool one(1);
    EXPECT_EQ(EncodeQuickPng(rgb, width, height, one), png);
    EXPECT_NE(png.find("sRGB"), std::string::npos);
  }
}

TEST(QuickPngTest, RefusesAnotherSize) {
  ThreadPool pool(1);
  EXPECT_THROW(EncodeQuickPng(Wave(4, 4), 4, 5, pool), Error);
  EXPECT_THROW(EncodeQuickPng({}, 0, 0, pool), Error);
}

}  // namespace
}  // namespace color3d
