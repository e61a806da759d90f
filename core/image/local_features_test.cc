#include "core/image/local_features.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

// Random values on a coarse grid, made smooth: corners and blobs.
Image Blobs(int width, int height, uint64_t seed) {
  Random random(seed);
  Image coarse(width / 12, height / 12, 1);
  for (float& v : coarse.data) v = static_cast<float>(random.NextUniform());
  return Resize(coarse, width, height);
}

TEST(LocalFeatures, ReturnsUnitRowsStrongestFirst) {
  const Image picture = Blobs(240, 180, 1);
  const LocalFeatures all = DetectLocalFeatures(picture, 10'000);
  const LocalFeatures some = DetectLocalFeatures(picture, 30);
  ASSERT_GT(all.count(), 30);
  EXPECT_EQ(some.count(), 30);
  for (int i = 0; i < all.count(); ++i) {
    double sum = 0.0;
    for (int d = 0; d < LocalFeatures::kDimensions; ++d) {
      sum += std::pow(all.descriptors[i * LocalFeatures::kDimensions + d], 2);
    }
    EXPECT_NEAR(sum, 1.0, 1e-4);
  }
  EXPECT_EQ(DetectLocalFeatures(picture, 10'000).descriptors, all.descriptors);
}

TEST(LocalFeatures, FlatPictureHasNoFeatures) {
  EXPECT_EQ(DetectLocalFeatures(Image(64, 48, 1, 0.5f), 100).count(), 0);
  EXPECT_EQ(DetectLocalFeatures(Image(1, 1, 1, 0.5f), 100).count(), 0);
  EXPECT_THROW(DetectLocalFeatures(Image(), 100), Error);
  EXPECT_THROW(DetectLocalFeatures(Image(8, 8, 1), 0), Error);
}

}  // namespace
}  // namespace color3d
