#include "core/augment/outpaint.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

// The colour of every pixel encodes its position.
Image Labeled(int width, int height) {
  Image lab(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      lab.At(0, y, x) = 50.0f + 30.0f * std::sin(0.3f * x) * std::cos(0.2f * y);
      lab.At(1, y, x) = static_cast<float>(x) - 40.0f;
      lab.At(2, y, x) = static_cast<float>(y) - 30.0f;
    }
  }
  return lab;
}

const CancellationToken kGoOn;

TEST(OutpaintTest, MovesQuadrantToOppositeCornerAndExtendsIt) {
  const Image lab = Labeled(81, 64);  // odd and even
  struct Expectation {
    Quadrant quadrant;
    int source_x, source_y;  // of the quadrant's upper left pixel
    int canvas_x, canvas_y;
  };
  for (const Expectation& e : {Expectation{Quadrant::kUpperLeft, 0, 0, 40, 32},
                               Expectation{Quadrant::kUpperRight, 40, 0, 0, 32},
                               Expectation{Quadrant::kLowerLeft, 0, 32, 40, 0},
                               Expectation{Quadrant::kLowerRight, 40, 32, 0, 0}}) {
    const GeneratedPicture picture = OutpaintQuadrant(lab, e.quadrant, 1, kGoOn);
    ASSERT_EQ(picture.lab.width, 81);
    ASSERT_EQ(picture.lab.height, 64);
    int weighed = 0;
    for (const float w : picture.weight.data) weighed += w == 1.0f ? 1 : 0;
    EXPECT_EQ(weighed, 41 * 32) << "full weight on the quadrant only";
    // The middle of the quadrant, far from the seams.
    for (int y = 10; y < 22; ++y) {
      for (int x = 14; x < 26; ++x) {
        EXPECT_EQ(picture.weight.At(0, e.canvas_y + y, e.canvas_x + x), 1.0f);
        for (int c = 0; c < 3; ++c) {
          ASSERT_EQ(picture.lab.At(c, e.canvas_y + y, e.canvas_x + x),
                    lab.At(c, e.source_y + y, e.source_x + x))
              << static_cast<int>(e.quadrant) << " at " << x << ", " << y;
        }
      }
    }
  }
}

TEST(OutpaintTest, KeepsChromaWithItsLuminance) {
  // Dark things are red, bright ones green.
  Image lab(80, 60, 3);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x) {
      const bool bright = std::sin(0.31 * x) * std::cos(0.23 * y) > 0.1;
      lab.At(0, y, x) = bright ? 75.0f : 25.0f;
      lab.At(1, y, x) = bright ? -40.0f : 40.0f;
    }
  }
  const Image out = OutpaintQuadrant(lab, Quadrant::kUpperRight, 3, kGoOn).lab;
  for (size_t i = 0; i < out.PlaneSize(); ++i) {
    ASSERT_NEAR(std::abs(out.Plane(1)[i]), 40.0f, 1e-3f) << "a mixture at " << i;
    ASSERT_NEAR(out.Plane(0)[i], out.Plane(1)[i] < 0.0f ? 75.0f : 25.0f, 1e-3f) << i;
  }
}

TEST(OutpaintTest, SmoothsShadingAtSeams) {
  Image lab(160, 120, 3);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      lab.At(0, y, x) = 60.0f + 0.15f * x + 0.05f * y;
      lab.At(2, y, x) = -10.0f - 0.1f * x;
    }
  }
  const Image out = OutpaintQuadrant(lab, Quadrant::kUpperLeft, 1, kGoOn).lab;
  // 6.7 without evening out.
  for (int y = 1; y < 120; ++y) {
    for (int x = 1; x < 160; ++x) {
      ASSERT_LT(std::abs(out.At(0, y, x) - out.At(0, y, x - 1)), 4.0f) << x << ", " << y;
      ASSERT_LT(std::abs(out.At(0, y, x) - out.At(0, y - 1, x)), 4.0f) << x << ", " << y;
    }
  }
}

TEST(OutpaintTest, KeepsSeamsAsSmoothAsTexture) {
  Image lab(160, 120, 3);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      lab.At(0, y, x) = 50.0f + 20.0f * std::sin(0.45f * x) + 20.0f * std::cos(0.4f * y);
    }
  }
  const auto roughest = [](const Image& image) {
    float most = 0.0f;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 1; x < image.width; ++x) {
        most = std::max(most, std::abs(image.At(0, y, x) - image.At(0, y, x - 1)));
      }
    }
    return most;
  };
  const Image out = OutpaintQuadrant(lab, Quadrant::kLowerRight, 1, kGoOn).lab;
  EXPECT_LT(roughest(out), 2.0f * roughest(lab));
}

TEST(OutpaintTest, IsRepeatableForSameSeed) {
  Image lab = Labeled(96, 72);
  Random random(5);
  for (float& v : lab.data) v += static_cast<float>(random.NextNormal());
  const auto run = [&](uint64_t seed) {
    return OutpaintQuadrant(lab, Quadrant::kLowerLeft, seed, kGoOn).lab.data;
  };
  EXPECT_EQ(run(1), run(1));
}

TEST(OutpaintTest, CoversOddShapesAndRefusesTinyOnes) {
  for (const auto& [width, height] : {std::pair{32, 300}, {333, 33}, {32, 32}, {65, 47}}) {
    const GeneratedPicture picture =
        OutpaintQuadrant(Labeled(width, height), Quadrant::kUpperLeft, 1, kGoOn);
    // Luminance 0 is in no source pixel: nothing stayed empty.
    for (size_t i = 0; i < picture.lab.PlaneSize(); ++i) ASSERT_GT(picture.lab.Plane(0)[i], 1.0f);
  }
  EXPECT_THROW(OutpaintQuadrant(Labeled(31, 300), Quadrant::kUpperLeft, 1, kGoOn), Error);
  EXPECT_THROW(OutpaintQuadrant(Image(64, 64, 1), Quadrant::kUpperLeft, 1, kGoOn), Error);
}

TEST(OutpaintTest, StopsWhenCancelled) {
  CancellationToken cancel;
  cancel.Cancel();
  EXPECT_THROW(OutpaintQuadrant(Labeled(64, 64), Quadrant::kUpperLeft, 1, cancel), Error);
}

}  // namespace
}  // namespace color3d
