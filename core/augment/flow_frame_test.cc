#include "core/augment/flow_frame.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/image/fill_holes.h"

namespace color3d {
namespace {

Image Ramp(int width, int height) {
  Image lab(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      lab.At(0, y, x) = 100.0f * x / width;
      lab.At(1, y, x) = 60.0f * y / height;
      lab.At(2, y, x) = 0.5f * lab.At(0, y, x) - 20.0f;
    }
  }
  return lab;
}

TEST(FlowFrameTest, FlowIsSmallAndSmooth) {
  const Image lab = Ramp(200, 150);
  const GeneratedPicture frame = FlowFrame(lab, 4);
  double moved = 0.0;
  for (int y = 0; y < 150; ++y) {
    for (int x = 1; x < 200; ++x) {
      const double dx = (frame.lab.At(0, y, x) - lab.At(0, y, x)) * 2.0;
      moved += std::abs(dx) / (150 * 199);
      ASSERT_LT(std::abs(dx), 40.0);
      ASSERT_LT(std::abs(frame.lab.At(0, y, x) - frame.lab.At(0, y, x - 1)), 1.0f);
    }
  }
  EXPECT_GT(moved, 0.5);
}

TEST(FlowFrameTest, MovesColorWithLuminance) {
  const GeneratedPicture frame = FlowFrame(Ramp(120, 90), 2);
  int inside = 0;
  for (size_t i = 0; i < frame.lab.PlaneSize(); ++i) {
    EXPECT_NEAR(frame.lab.Plane(2)[i], 0.5f * frame.lab.Plane(0)[i] - 20.0f, 1e-3f);
    EXPECT_TRUE(frame.weight.data[i] == 0.0f || frame.weight.data[i] == 1.0f);
    inside += frame.weight.data[i] > 0.0f ? 1 : 0;
  }
  EXPECT_GT(inside, 120 * 90 * 8 / 10);
}

TEST(FlowFrameTest, DependsOnSeed) {
  const Image lab = Ramp(64, 48);
  EXPECT_EQ(FlowFrame(lab, 1).lab.data, FlowFrame(lab, 1).lab.data);
  EXPECT_NE(FlowFrame(lab, 1).lab.data, FlowFrame(lab, 2).lab.data);
  EXPECT_EQ(FlowFrame(Image(1, 1, 3, 7.0f), 1).lab.data, (std::vector<float>{7, 7, 7}));
}

TEST(FillHolesTest, FillsOnlyUnknownPixels) {
  Image image(40, 30, 1, -1000.0f), known(40, 30, 1);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      if (x > 10 && x < 30 && y > 8 && y < 20) continue;
      known.At(0, y, x) = 1.0f;
      image.At(0, y, x) = x < 20 ? 10.0f : 30.0f;
    }
  }
  const Image before = image;
  FillHoles(known, &image);
  for (size_t i = 0; i < image.PlaneSize(); ++i) {
    if (known.data[i] > 0.0f) {
      ASSERT_EQ(image.data[i], before.data[i]);
    } else {
      ASSERT_GE(image.data[i], 10.0f - 1e-3f);
      ASSERT_LE(image.data[i], 30.0f + 1e-3f);
    }
  }
  Image nothing(5, 5, 2, 3.0f);
  FillHoles(Image(5, 5, 1), &nothing);
  EXPECT_EQ(nothing.data, Image(5, 5, 2, 3.0f).data);
}

}  // namespace
}  // namespace color3d
