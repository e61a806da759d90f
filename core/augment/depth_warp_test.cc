#include "core/augment/depth_warp.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/augment/depth_filter.h"

namespace color3d {
namespace {

constexpr int kWidth = 80, kHeight = 60;

// A wall at depth 4 and, with `board`, a board at depth 2 before its left half.
DepthView Wall(bool board) {
  DepthView view;
  view.camera = {kWidth, kHeight, 70.0, 70.0, kWidth / 2.0, kHeight / 2.0};
  view.lab = Image(kWidth, kHeight, 3);
  view.depth = Image(kWidth, kHeight, 1, 4.0f);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool near = board && x < kWidth / 2;
      if (near) view.depth.At(0, y, x) = 2.0f;
      view.lab.At(0, y, x) = near ? 80.0f : 20.0f + 0.5f * x;
      view.lab.At(1, y, x) = near ? 50.0f : -50.0f;
      view.lab.At(2, y, x) = static_cast<float>(x);
    }
  }
  return view;
}

Pose MovedRight(double distance) {
  Pose pose;
  pose.translation = Eigen::Vector3d(-distance, 0.0, 0.0);
  return pose;
}

TEST(DepthWarpTest, SameCameraGivesSamePicture) {
  const DepthView key = Wall(false);
  const GeneratedPicture out = WarpToView(key, Pose(), {});
  for (int y = 1; y + 1 < kHeight; ++y) {
    for (int x = 1; x + 1 < kWidth; ++x) {
      ASSERT_EQ(out.weight.At(0, y, x), 1.0f);
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(out.lab.At(c, y, x), key.lab.At(c, y, x), 1e-3f);
    }
  }
}

TEST(DepthWarpTest, ShiftsWallByDisparity) {
  const GeneratedPicture out = WarpToView(Wall(false), MovedRight(0.4), {});
  for (int y = 1; y + 1 < kHeight; ++y) {
    // 70 * 0.4 / 4 = 7 px to the left.
    for (int x = 1; x < kWidth - 8; ++x) ASSERT_NEAR(out.lab.At(2, y, x), x + 7.0f, 1e-3f);
    for (int x = kWidth - 7; x < kWidth; ++x) ASSERT_EQ(out.weight.At(0, y, x), 0.0f);
  }
}

TEST(DepthWarpTest, CutsDepthEdgesAndOccludesFarSurfaces) {
  // To the right: the board moves 14 px left, the wall 7: a gap opens between them.
  const GeneratedPicture apart = WarpToView(Wall(true), MovedRight(0.4), {});
  const int y = kHeight / 2;
  for (int x = 27; x <= 31; ++x) EXPECT_EQ(apart.weight.At(0, y, x), 0.0f) << x;
  // To the left: the board moves 14 px right, over the wall that moves 7.
  const GeneratedPicture over = WarpToView(Wall(true), MovedRight(-0.4), {});
  for (int x = 40; x <= 52; ++x) EXPECT_NEAR(over.lab.At(1, y, x), 50.0f, 1e-3f) << x;
  for (int c = 0; c < kWidth; ++c) {
    if (over.weight.At(0, y, c) == 0.0f) continue;
    const float a = over.lab.At(1, y, c);
    EXPECT_TRUE(std::abs(a - 50.0f) < 1e-3f || std::abs(a + 50.0f) < 1e-3f) << "a mixture at " << c;
  }
}

TEST(DepthWarpTest, FillsHolesFromGeometryWithZeroWeight) {
  TargetGeometry geometry{Image(kWidth, kHeight, 1, 66.0f), Image(kWidth, kHeight, 1, 4.0f)};
  const GeneratedPicture out = WarpToView(Wall(false), MovedRight(0.4), geometry);
  EXPECT_EQ(out.lab.At(0, 30, kWidth - 2), 66.0f);
  EXPECT_EQ(out.weight.At(0, 30, kWidth - 2), 0.0f);
  EXPECT_EQ(out.weight.At(0, 30, 20), 1.0f);
  // Something that the key view does not see stands before the wall.
  for (int x = 0; x < 20; ++x) geometry.depth.At(0, 30, x) = 1.0f;
  const GeneratedPicture hidden = WarpToView(Wall(false), MovedRight(0.4), geometry);
  EXPECT_EQ(hidden.weight.At(0, 30, 10), 0.0f);
  EXPECT_EQ(hidden.lab.At(0, 30, 10), 66.0f);
  EXPECT_EQ(hidden.weight.At(0, 31, 10), 1.0f);
}

TEST(DepthFilterTest, RemovesNoiseAndKeepsEdges) {
  Image depth = Wall(true).depth;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) depth.At(0, y, x) *= 1.0f + 0.05f * ((x * 7 + y * 13) % 3 - 1);
  }
  depth.At(0, 20, 20) = 0.0f;
  depth.At(0, 30, 30) = 40.0f;
  depth.At(0, 40, 60) = std::nanf("");
  const Image smooth = SmoothDepth(depth);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if ((x == 20 && y == 20) || (x == 60 && y == 40)) {
        ASSERT_EQ(smooth.At(0, y, x), 0.0f) << "unknown";
        continue;
      }
      ASSERT_NEAR(smooth.At(0, y, x), x < kWidth / 2 ? 2.0f : 4.0f, 0.1f) << x << ", " << y;
    }
  }
}

TEST(DepthWarpTest, StaysFiniteForExtremeDepthsAndPoses) {
  DepthView key = Wall(true);
  key.depth.At(0, 3, 3) = 1e-20f;
  key.depth.At(0, 4, 4) = 1e20f;
  key.depth.At(0, 5, 5) = std::nanf("");
  key.depth.At(0, 6, 6) = -1.0f;
  Pose behind;
  behind.translation = Eigen::Vector3d(0.0, 0.0, -100.0);
  for (const Pose& pose : {behind, MovedRight(1e12), MovedRight(1e-12), MovedRight(3.9)}) {
    const GeneratedPicture out = WarpToView(key, pose, {});
    for (const float v : out.lab.data) ASSERT_TRUE(std::isfinite(v));
  }
}

}  // namespace
}  // namespace color3d
