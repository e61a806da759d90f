#include "core/keycolor/recolor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/color/lab.h"

namespace color3d {
namespace {

// A Lab picture inside the sRGB gamut with the chroma (a, b) everywhere.
Image MakeLab(float a, float b) {
  Image lab(40, 30, 3);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      lab.At(0, y, x) = 50.0f + 15.0f * std::sin(0.3f * x) + 8.0f * std::cos(0.4f * y);
      lab.At(1, y, x) = a;
      lab.At(2, y, x) = b;
    }
  }
  return lab;
}

Image WhiteFrom(int first_x) {
  Image mask(40, 30, 1, 0.0f);
  for (int y = 0; y < 30; ++y) {
    for (int x = first_x; x < 40; ++x) mask.At(0, y, x) = 1.0f;
  }
  return mask;
}

std::string MessageOf(const Image& original, const Image& edited, const Image* mask) {
  try {
    KeyColorFromEdit(original, edited, mask);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    return error.what();
  }
  return "";
}

TEST(RecolorTest, ChangesOnlyInsideMask) {
  const Image original = SrgbFromLab(MakeLab(10, 10));
  const Image edited = SrgbFromLab(MakeLab(-15, 5));
  const Image mask = WhiteFrom(20);
  const Image before = LabFromSrgb(original);
  const Image after = LabFromSrgb(edited);
  const Image ab = KeyColorFromEdit(original, edited, &mask);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 20; ++x) {
      ASSERT_EQ(ab.At(0, y, x), before.At(1, y, x));
      ASSERT_EQ(ab.At(1, y, x), before.At(2, y, x));
    }
    for (int x = 22; x < 40; ++x) ASSERT_NEAR(ab.At(0, y, x), after.At(1, y, x), 1e-4f);
    // Feathered, monotone, never beyond either colour: no halo.
    ASSERT_NEAR(ab.At(0, y, 20), 10.0f - 25.0f / 3.0f, 0.1f);
    ASSERT_NEAR(ab.At(0, y, 21), 10.0f - 50.0f / 3.0f, 0.1f);
  }
}

TEST(RecolorTest, AppliesEditEverywhereWithoutMask) {
  const Image edited = SrgbFromLab(MakeLab(-15, 5));
  const Image ab = KeyColorFromEdit(SrgbFromLab(MakeLab(10, 10)), edited, nullptr);
  for (size_t i = 0; i < ab.PlaneSize(); ++i) {
    ASSERT_NEAR(ab.Plane(0)[i], -15.0f, 0.05f);
    ASSERT_NEAR(ab.Plane(1)[i], 5.0f, 0.05f);
  }
}

TEST(RecolorTest, AcceptsEditThatRemovesColor) {
  EXPECT_EQ(MessageOf(SrgbFromLab(MakeLab(10, 10)), SrgbFromLab(MakeLab(0, 0)), nullptr), "");
}

TEST(RecolorTest, RefusesEditWithoutChange) {
  const Image original = SrgbFromLab(MakeLab(10, 10));
  EXPECT_NE(MessageOf(original, original, nullptr).find("nothing would change"), std::string::npos);
  // An edit outside the mask only.
  Image edited = MakeLab(10, 10);
  for (int y = 0; y < 30; ++y) edited.At(1, y, 3) = -20.0f;
  const Image mask = WhiteFrom(20);
  EXPECT_NE(MessageOf(original, SrgbFromLab(edited), &mask).find("inside the mask"),
            std::string::npos);
}

TEST(RecolorTest, RefusesPicturesThatDoNotFit) {
  const Image original = SrgbFromLab(MakeLab(10, 10));
  const Image edited = SrgbFromLab(MakeLab(-15, 5));
  const Image black(40, 30, 1, 0.0f), wrong(41, 30, 1, 1.0f), noise(40, 30, 3, 0.2f);
  EXPECT_NE(MessageOf(original, edited, &black).find("the mask allows no change"),
            std::string::npos);
  EXPECT_NE(MessageOf(original, edited, &wrong).find("the mask is 41x30"), std::string::npos);
  EXPECT_NE(MessageOf(original, Image(41, 30, 3), nullptr).find("41x30"), std::string::npos);
  EXPECT_NE(MessageOf(original, Image(40, 30, 4), nullptr).find("4 channels"), std::string::npos);
  EXPECT_NE(MessageOf(Image(40, 30, 1), edited, nullptr).find("in colour"), std::string::npos);
  EXPECT_NE(MessageOf(original, noise, nullptr).find("does not resemble"), std::string::npos);
}

}  // namespace
}  // namespace color3d
