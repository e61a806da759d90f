#include "core/augment/augment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/base/error.h"

namespace color3d {
namespace {

// L is a smooth ramp pattern, ab an affine function of L: any map that treats both alike keeps it.
struct Picture {
  Image luminance;
  Image ab;
};

Picture MakePicture(int width, int height) {
  Picture picture{Image(width, height, 1), Image(width, height, 2)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float l = 50.0f + 20.0f * std::sin(0.21f * x) + 20.0f * std::cos(0.17f * y + 0.05f * x);
      picture.luminance.At(0, y, x) = l;
      picture.ab.At(0, y, x) = 0.8f * l - 30.0f;
      picture.ab.At(1, y, x) = 10.0f - 0.5f * l;
    }
  }
  return picture;
}

AugmentOptions Identity(int crop) {
  AugmentOptions options;
  options.crop_px = crop;
  options.min_scale = options.max_scale = 1.0;
  options.flip_probability = options.elastic_probability = options.perspective_probability = 0.0;
  options.luminance_jitter = 0.0;
  return options;
}

void ExpectAligned(const AugmentedSample& sample, float tolerance) {
  for (size_t i = 0; i < sample.luminance.PlaneSize(); ++i) {
    const float l = sample.luminance.data[i];
    ASSERT_NEAR(sample.ab.Plane(0)[i], 0.8f * l - 30.0f, tolerance);
    ASSERT_NEAR(sample.ab.Plane(1)[i], 10.0f - 0.5f * l, tolerance);
  }
}

TEST(AugmentTest, ReturnsPictureForIdentity) {
  const Picture picture = MakePicture(64, 64);
  Random random(3);
  const AugmentedSample sample = Augment(picture.luminance, picture.ab, {}, Identity(64), random);
  EXPECT_EQ(sample.luminance.data, picture.luminance.data);
  EXPECT_EQ(sample.ab.data, picture.ab.data);
  EXPECT_EQ(*std::min_element(sample.valid.data.begin(), sample.valid.data.end()), 1.0f);
}

TEST(AugmentTest, KeepsChromaWithItsLuminance) {
  const Picture picture = MakePicture(97, 61);
  AugmentOptions mild;
  mild.crop_px = 48;
  mild.luminance_jitter = 0.0;
  AugmentOptions paper = AugmentOptions::Paper();
  paper.crop_px = 48;
  Random random(7);
  for (int i = 0; i < 20; ++i) {
    ExpectAligned(Augment(picture.luminance, picture.ab, {}, mild, random), 1e-3f);
    ExpectAligned(Augment(picture.luminance, picture.ab, {}, paper, random), 1e-3f);
  }
}

TEST(AugmentTest, CropsOnlyShiftsPictures) {
  Image ramp(97, 61, 1);
  for (int y = 0; y < 61; ++y) {
    for (int x = 0; x < 97; ++x) ramp.At(0, y, x) = 0.3f * x + 0.5f * y;
  }
  AugmentOptions options = AugmentOptions::CropsOnly();
  options.crop_px = 32;
  Random random(7);
  std::set<float> corners;
  for (int i = 0; i < 8; ++i) {
    const Image crop = Augment(ramp, Image(97, 61, 2), {}, options, random).luminance;
    corners.insert(crop.At(0, 1, 1));
    for (int y = 1; y < 30; ++y) {
      for (int x = 1; x < 30; ++x) {
        ASSERT_NEAR(crop.At(0, y, x + 1) - crop.At(0, y, x), 0.3f, 1e-3f);
        ASSERT_NEAR(crop.At(0, y + 1, x) - crop.At(0, y, x), 0.5f, 1e-3f);
      }
    }
  }
  EXPECT_GT(corners.size(), 4u) << "at several places";
}

TEST(AugmentTest, LuminanceJitterLeavesChromaAlone) {
  const Picture picture = MakePicture(64, 64);
  AugmentOptions options = Identity(64);
  options.luminance_jitter = 5.0;
  Random random(3);
  const AugmentedSample sample = Augment(picture.luminance, picture.ab, {}, options, random);
  EXPECT_EQ(sample.ab.data, picture.ab.data);
  EXPECT_NE(sample.luminance.data, picture.luminance.data);
  for (size_t i = 0; i < sample.luminance.data.size(); ++i) {
    ASSERT_NEAR(sample.luminance.data[i], picture.luminance.data[i], 5.0 + 2.5);
  }
}

TEST(AugmentTest, ShuffleMovesWholeCellsWithoutMixing) {
  // Each of the 4x4 cells has its own value: mixing two would make a new one.
  Image luminance(64, 64, 1);
  Image ab(64, 64, 2);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) luminance.At(0, y, x) = static_cast<float>(y / 16 * 4 + x / 16);
  }
  std::copy_n(luminance.data.begin(), luminance.PlaneSize(), ab.data.begin());
  AugmentOptions options = Identity(64);
  options.shuffle_probability = 1.0;
  options.shuffle_grid = 4;
  options.elastic_probability = 1.0;  // positions between pixels, too
  options.elastic.alpha_px = 3.0;
  options.elastic.sigma_px = 20.0;
  Random random(5);
  const AugmentedSample sample = Augment(luminance, ab, {}, options, random);
  for (float value : sample.ab.data) ASSERT_EQ(value, std::round(value));
  EXPECT_NE(sample.luminance.data, luminance.data);
}

TEST(AugmentTest, ShuffleIsAPermutation) {
  const Picture picture = MakePicture(64, 64);
  AugmentOptions options = Identity(64);
  options.shuffle_probability = 1.0;
  Random random(5);
  const AugmentedSample sample = Augment(picture.luminance, picture.ab, {}, options, random);
  std::vector<float> before = picture.luminance.data;
  std::vector<float> after = sample.luminance.data;
  EXPECT_NE(before, after);
  std::sort(before.begin(), before.end());
  std::sort(after.begin(), after.end());
  EXPECT_EQ(before, after);
}

TEST(AugmentTest, ProducesAllEightSymmetries) {
  const Picture picture = MakePicture(40, 40);
  AugmentOptions options = Identity(40);
  options.flip_probability = 0.5;
  options.rot90_probability = 1.0;
  std::set<std::vector<float>> seen;
  Random random(11);
  for (int i = 0; i < 200; ++i) {
    const AugmentedSample sample = Augment(picture.luminance, picture.ab, {}, options, random);
    ExpectAligned(sample, 0.0f + 1e-4f);
    seen.insert(sample.luminance.data);
  }
  EXPECT_EQ(seen.size(), 8u);
}

TEST(AugmentTest, MarksPixelsOutsideThePictureInvalid) {
  const Picture picture = MakePicture(40, 20);
  Random random(1);
  const AugmentedSample sample = Augment(picture.luminance, picture.ab, {}, Identity(60), random);
  double valid = 0.0;
  for (float value : sample.valid.data) valid += value;
  EXPECT_EQ(valid, 40.0 * 20.0);
  EXPECT_EQ(sample.valid.At(0, 0, 0), 0.0f);
  EXPECT_EQ(sample.valid.At(0, 30, 30), 1.0f);
  ExpectAligned(sample, 1e-3f);
}

TEST(AugmentTest, IsRepeatableForSameGenerator) {
  const Picture picture = MakePicture(50, 50);
  AugmentOptions options = AugmentOptions::Paper();
  options.crop_px = 32;
  Random first(9);
  Random second(9);
  EXPECT_EQ(Augment(picture.luminance, picture.ab, {}, options, first).ab.data,
            Augment(picture.luminance, picture.ab, {}, options, second).ab.data);
  EXPECT_EQ(first.state().state, second.state().state);
}

TEST(AugmentTest, AcceptsOnePixelPicture) {
  AugmentOptions options = AugmentOptions::Paper();
  options.crop_px = 8;
  Random random(2);
  const AugmentedSample sample =
      Augment(Image(1, 1, 1, 40.0f), Image(1, 1, 2, 5.0f), {}, options, random);
  for (float value : sample.luminance.data) EXPECT_EQ(value, 40.0f);
}

TEST(AugmentTest, RefusesUnequalSizes) {
  Random random(2);
  EXPECT_THROW(Augment(Image(4, 4, 1), Image(5, 4, 2), {}, {}, random), Error);
  EXPECT_THROW(Augment(Image(4, 4, 3), Image(4, 4, 2), {}, {}, random), Error);
}

}  // namespace
}  // namespace color3d
