#include "core/splat/geometry/held_out.h"

#include <gtest/gtest.h>

#include <cmath>

namespace color3d {
namespace {

TEST(CompareClampedTest, ClampsBeforeComparing) {
  PlaneBuffer drawn(20, 18, 3), truth(20, 18, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 18; ++y) {
      for (int x = 0; x < 20; ++x) {
        drawn.Row(c, y)[x] = 1.5f;
        truth.Row(c, y)[x] = c == 0 ? 0.9f : 1.0f;
      }
    }
  }
  ImageLoss loss;
  ThreadPool pool(1);
  const PictureQuality quality = CompareClamped(truth, nullptr, loss, pool, drawn);
  EXPECT_NEAR(quality.psnr_db, -10.0 * std::log10(0.01 / 3.0), 1e-3);
  EXPECT_NEAR(quality.l1, 0.1 / 3.0, 1e-5);
  EXPECT_EQ(drawn.Row(1, 3)[4], 1.0f);
}

TEST(CompareClampedTest, ComparesMaskedPixelsOnly) {
  PlaneBuffer drawn(32, 24, 1), truth(32, 24, 1), mask(32, 24, 1);
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 32; ++x) {
      mask.Row(0, y)[x] = x < 16 ? 1.0f : 0.0f;
      truth.Row(0, y)[x] = 0.5f;
      drawn.Row(0, y)[x] = x < 16 ? 0.6f : 0.0f;
    }
  }
  ImageLoss loss;
  ThreadPool pool(1);
  const PictureQuality quality = CompareClamped(truth, &mask, loss, pool, drawn);
  EXPECT_NEAR(quality.psnr_db, 20.0, 1e-3);
  EXPECT_NEAR(quality.l1, 0.1, 1e-5);
  EXPECT_EQ(drawn.Row(0, 5)[20], 0.5f);
  ZeroMasked(mask, drawn);
  EXPECT_EQ(drawn.Row(0, 5)[20], 0.0f);
  EXPECT_EQ(drawn.Row(0, 5)[10], 0.6f);
}

}  // namespace
}  // namespace color3d
