#include "core/stage/sources/given_colors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/stage/context/stage_context.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

using Kind = PaintedColors::Kind;
using testing::HasSubstr;

class GivenColorsTest : public StageTest {
 protected:
  void SetUp() override {
    StageTest::SetUp();
    photo_ = Image(48, 32, 3);
    for (int y = 0; y < 32; ++y) {
      for (int x = 0; x < 48; ++x) {
        for (int c = 0; c < 3; ++c) photo_.At(c, y, x) = 0.2f + 0.012f * static_cast<float>(x);
      }
    }
    ab_ = Image(12, 8, 2, 12.0f);
  }
  GivenColors Read(Kind kind, const Image& picture) {
    const PaintedColors painted{kind, scratch_.path() / "given.png", {}};
    WriteFileAtomic(painted.file, EncodePng8(picture));
    StageContext context = MakeContext();
    return ReadGivenColors(painted, photo_, ab_, context);
  }
  std::string Refusal(Kind kind, const Image& picture) {
    try {
      Read(kind, picture);
    } catch (const Error& e) {
      return e.what();
    }
    return "nothing was refused";
  }
  static double Sum(const Image& picture) {
    double sum = 0.0;
    for (const float value : picture.data) sum += value;
    return sum;
  }

  Image photo_, ab_;
};

// Paints a box in a strong green.
void PaintBox(int left, int top, int width, int height, Image* picture) {
  for (int y = top; y < top + height; ++y) {
    for (int x = left; x < left + width; ++x) {
      picture->At(0, y, x) = 0.1f;
      picture->At(1, y, x) = 0.6f;
      picture->At(2, y, x) = 0.1f;
      if (picture->channels == 4) picture->At(3, y, x) = 1.0f;
    }
  }
}

TEST_F(GivenColorsTest, PictureCountsWhereItWasChanged) {
  Image painted = PaintablePhoto(photo_, ab_);
  PaintBox(10, 5, 8, 6, &painted);
  const GivenColors given = Read(Kind::kPicture, painted);
  EXPECT_EQ(Sum(given.given), 48.0);
  EXPECT_EQ(given.given.At(0, 6, 12), 1.0f);
  EXPECT_LT(given.ab.At(0, 6, 12), -30.0f) << "green";
}

TEST_F(GivenColorsTest, TakesStrokesOfAnotherSize) {
  Image layer(96, 64, 4);
  PaintBox(20, 10, 16, 12, &layer);
  const GivenColors given = Read(Kind::kStrokes, layer);
  EXPECT_NEAR(Sum(given.given), 48.0, 4.0);
  EXPECT_LT(given.ab.At(0, 7, 13), -30.0f);
}

TEST_F(GivenColorsTest, RefusesUnusablePictures) {
  EXPECT_THAT(Refusal(Kind::kPicture, PaintablePhoto(photo_, ab_)), HasSubstr("no pixel"));
  Image other_shape(48, 48, 4);
  PaintBox(2, 2, 8, 8, &other_shape);
  EXPECT_THAT(Refusal(Kind::kStrokes, other_shape), HasSubstr("48x48"));
  EXPECT_THAT(Refusal(Kind::kPicture, Image(96, 64, 3, 0.5f)), HasSubstr("96x64"));
}

}  // namespace
}  // namespace color3d
