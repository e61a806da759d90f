#include "core/image/crop.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "core/image/image_checks.h"

namespace color3d {
namespace {

TEST(CropTest, ReturnsPartOfEachPlane) {
  Image image(5, 4, 2);
  for (int c = 0; c < 2; ++c) {
    for (int y = 0; y < 4; ++y) {
      for (int x = 0; x < 5; ++x) image.At(c, y, x) = static_cast<float>(100 * c + 10 * y + x);
    }
  }
  const Image part = Crop(image, 2, 1, 3, 2);
  ASSERT_EQ(part.width, 3);
  ASSERT_EQ(part.height, 2);
  EXPECT_EQ(part.data, (std::vector<float>{12, 13, 14, 22, 23, 24, 112, 113, 114, 122, 123, 124}));
  EXPECT_EQ(Crop(image, 0, 0, 5, 4).data, image.data);
}

TEST(ImageChecksTest, RefusesOtherPicturesThanLuminance) {
  RequireLuminance(Image(2, 2, 1), "the encoder");
  EXPECT_THROW(RequireLuminance(Image(), "the encoder"), Error);
  try {
    RequireLuminance(Image(2, 2, 3), "the encoder");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_STREQ(error.what(),
                 "the encoder takes a picture with 1 channel (L), but got 3 channels");
  }
}

TEST(ImageChecksTest, FindsNonFiniteValues) {
  Image image(2, 2, 1);
  EXPECT_TRUE(IsFinite(image));
  for (const float value :
       {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    image.data[3] = value;
    EXPECT_FALSE(IsFinite(image));
  }
}

}  // namespace
}  // namespace color3d
