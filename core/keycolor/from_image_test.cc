#include "core/keycolor/from_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"

namespace color3d {
namespace {

// A Lab picture with structure in L and colour, inside the sRGB gamut.
Image MakeLab(int width, int height) {
  Image lab(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      lab.At(0, y, x) = 50.0f + 15.0f * std::sin(0.3f * x) + 10.0f * std::cos(0.2f * y);
      lab.At(1, y, x) = 15.0f * std::sin(0.05f * x);
      lab.At(2, y, x) = 20.0f * std::cos(0.07f * y);
    }
  }
  return lab;
}

std::string MessageOf(const Image& luminance, const Image& colored) {
  try {
    KeyColorFromImage(luminance, colored);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    return error.what();
  }
  return "";
}

TEST(KeyColorFromImageTest, ReturnsChroma) {
  const Image lab = MakeLab(60, 40);
  const auto [ab, painted] = KeyColorFromImage(LuminanceOfLab(lab), SrgbFromLab(lab));
  EXPECT_TRUE(painted.Empty());
  ASSERT_EQ(ab.channels, 2);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 60; ++x) {
      ASSERT_NEAR(ab.At(0, y, x), lab.At(1, y, x), 0.02f);
      ASSERT_NEAR(ab.At(1, y, x), lab.At(2, y, x), 0.02f);
    }
  }
}

TEST(KeyColorFromImageTest, AcceptsChangedToneCurve) {
  Image lab = MakeLab(60, 40);
  const Image luminance = LuminanceOfLab(lab);
  for (size_t i = 0; i < lab.PlaneSize(); ++i) lab.data[i] = 20.0f + 0.6f * lab.data[i];
  EXPECT_EQ(MessageOf(luminance, SrgbFromLab(lab)), "");
}

TEST(KeyColorFromImageTest, NamesBothSizesWhenTheyDiffer) {
  const Image lab = MakeLab(60, 40);
  const std::string message = MessageOf(Image(61, 40, 1), SrgbFromLab(lab));
  EXPECT_NE(message.find("60x40"), std::string::npos) << message;
  EXPECT_NE(message.find("61x40"), std::string::npos) << message;
}

TEST(KeyColorFromImageTest, RefusesGrayPicture) {
  Image lab = MakeLab(60, 40);
  const Image luminance = LuminanceOfLab(lab);
  for (int c = 1; c < 3; ++c) std::fill_n(lab.Plane(c), lab.PlaneSize(), 0.5f);
  EXPECT_NE(MessageOf(luminance, SrgbFromLab(lab)).find("has no colour"), std::string::npos);
  EXPECT_NE(MessageOf(luminance, Image(60, 40, 1, 0.5f)).find("has no colour"), std::string::npos);
}

TEST(KeyColorFromImageTest, AcceptsSmallColoredObject) {
  Image lab = MakeLab(60, 40);
  const Image luminance = LuminanceOfLab(lab);
  for (int c = 1; c < 3; ++c) std::fill_n(lab.Plane(c), lab.PlaneSize(), 0.0f);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) lab.At(2, y, x) = 30.0f;
  }
  EXPECT_EQ(MessageOf(luminance, SrgbFromLab(lab)), "");
}

TEST(KeyColorFromImageTest, RefusesUnrelatedPicture) {
  const Image lab = MakeLab(60, 40);
  Image other(60, 40, 1);
  Random random(1);
  for (float& value : other.data) value = static_cast<float>(random.NextUniform(0.0, 100.0));
  EXPECT_NE(MessageOf(other, SrgbFromLab(lab)).find("does not resemble the key view"),
            std::string::npos);
  // A negative does not correlate either.
  Image negative = LuminanceOfLab(lab);
  for (float& value : negative.data) value = 100.0f - value;
  EXPECT_NE(MessageOf(negative, SrgbFromLab(lab)), "");
}

TEST(KeyColorFromImageTest, AcceptsFlatPictures) {
  Image colored(20, 20, 3, 0.4f);
  std::fill_n(colored.Plane(0), colored.PlaneSize(), 0.6f);
  EXPECT_EQ(MessageOf(Image(20, 20, 1, 50.0f), colored), "");
  const Image structured = LuminanceOfLab(MakeLab(20, 20));
  EXPECT_NE(MessageOf(structured, colored), "");
}

TEST(KeyColorFromImageTest, RefusesNonFiniteValues) {
  const Image lab = MakeLab(20, 20);
  Image colored = SrgbFromLab(lab);
  colored.data[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(MessageOf(LuminanceOfLab(lab), colored), "");
}

// Returns the picture with alpha 1 left of `columns`, else transparent black.
Image PaintedLeftOf(int columns, const Image& srgb) {
  Image painted(srgb.width, srgb.height, 4);
  for (int y = 0; y < srgb.height; ++y) {
    for (int x = 0; x < std::min(columns, srgb.width); ++x) {
      for (int c = 0; c < 3; ++c) painted.At(c, y, x) = srgb.At(c, y, x);
      painted.At(3, y, x) = 1.0f;
    }
  }
  return painted;
}

TEST(KeyColorFromImageTest, IgnoresUnpaintedPixels) {
  const Image lab = MakeLab(60, 40);
  const Image luminance = LuminanceOfLab(lab), srgb = SrgbFromLab(lab);
  const auto [ab, painted] = KeyColorFromImage(luminance, PaintedLeftOf(20, srgb));
  ASSERT_EQ(painted.width, 60);
  for (int x = 0; x < 60; ++x) {
    EXPECT_EQ(painted.At(0, 7, x), x < 20 ? 1.0f : 0.0f) << x;
    EXPECT_NEAR(ab.At(0, 7, x), x < 20 ? lab.At(1, 7, x) : 0.0f, 0.02f) << x;
  }
  EXPECT_TRUE(KeyColorFromImage(luminance, PaintedLeftOf(60, srgb)).painted.Empty());
  EXPECT_NE(MessageOf(luminance, PaintedLeftOf(0, srgb)).find("transparent"), std::string::npos);
}

}  // namespace
}  // namespace color3d
