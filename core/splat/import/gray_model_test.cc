#include "core/splat/import/gray_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/splat/export/rgb_harmonics.h"
#include "tests/support/formats/viewer_files.h"
#include "tests/support/scenes/splat_files.h"

namespace color3d {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(GrayModelTest, LuminanceMatchesColor) {
  ThreadPool pool(2);
  ViewerGaussians g = BallOnGround(300, 0.4f);
  for (float& sh : g.sh) sh = std::clamp(sh, -1.7f, 1.7f);  // sRGB 0..1
  const GraySplat gray = GrayModelOf(g, "g", pool);
  EXPECT_EQ(gray.dropped, 0);
  EXPECT_GT(gray.chroma, 10.0);
  ASSERT_EQ(gray.model.size(), g.size());
  EXPECT_EQ(gray.model.position, g.position);
  for (size_t i = 0; i < g.size(); ++i) {
    const auto channel = [&](int c) { return 0.5 + double{kShDc} * g.sh[3 * i + c]; };
    const LabColor lab = LabFromSrgb(RgbColor{channel(0), channel(1), channel(2)});
    EXPECT_NEAR(100.0 * (0.5 + kShDc * gray.model.sh_l[i]), lab.l, 1e-3);
  }
}

TEST(GrayModelTest, GrayHarmonicsSurviveExport) {
  ThreadPool pool(2);
  ViewerGaussians g = BallOnGround(100, 0.0f, 3);
  for (size_t i = 0; i < g.sh.size(); i += 3) g.sh[i + 1] = g.sh[i + 2] = g.sh[i];
  for (float& sh : g.sh) sh = std::clamp(sh, -0.6f, 0.6f);
  const GraySplat gray = GrayModelOf(g, "g", pool);
  EXPECT_LT(gray.chroma, 0.1);
  EXPECT_EQ(gray.model.sh_degree, 3);
  const RgbHarmonics rgb = FitRgbHarmonics(gray.model, pool);
  for (size_t i = 0; i < g.sh.size(); ++i) EXPECT_NEAR(rgb.sh[i], g.sh[i], 0.02) << i;
}

TEST(GrayModelTest, RendersGrayLikeViewers) {
  ThreadPool pool(2);
  const ViewerGaussians g = BallOnGround(4000);
  const GraySplat gray = GrayModelOf(g, "g", pool);
  Pose pose;
  pose.translation = {0.0, 0.0, 4.0};
  const Camera camera{160, 120, 150.0, 150.0, 80.0, 60.0};
  const RgbHarmonics rgb = FitRgbHarmonics(gray.model, pool);
  const ViewerGaussians back = ForViewers(gray.model, rgb, {}, pool);
  EXPECT_GT(
      PsnrOf(RenderForViewers(g, camera, pose, pool), RenderForViewers(back, camera, pose, pool)),
      35.0);
}

TEST(GrayModelTest, DropsNaNsAndClampsInfinities) {
  ThreadPool pool(2);
  ViewerGaussians g = BallOnGround(10, 0.0f, 1);
  g.position[3 * 1] = kNan;
  g.sh[12 * 3 + 5] = kNan;
  g.rotation[4 * 4] = kInfinity;
  g.opacity_logit[6] = kNan;
  g.opacity_logit[7] = kInfinity;
  g.log_scale[3 * 8] = -kInfinity;
  for (int k = 0; k < 4; ++k) g.rotation[4 * 9 + k] = 0.0f;
  const GraySplat gray = GrayModelOf(g, "g", pool);
  EXPECT_EQ(gray.dropped, 4);
  ASSERT_EQ(gray.model.size(), 6u);
  EXPECT_EQ(gray.model.position[0], g.position[0]);
  EXPECT_EQ(gray.model.position[3], g.position[6]);
  // In order: 0, 2, 5, 7, 8, 9.
  EXPECT_EQ(gray.model.opacity_logit[3], 15.0f);
  EXPECT_EQ(gray.model.log_scale[3 * 4], -30.0f);
  EXPECT_EQ(gray.model.rotation[4 * 5], 1.0f);
  ParseGaussians(SerializeGaussians(gray.model));  // throws for values that are not finite
}

TEST(GrayModelTest, RejectsModelWithoutFiniteGaussians) {
  ThreadPool pool(1);
  ViewerGaussians g = BallOnGround(3);
  for (float& x : g.opacity_logit) x = kNan;
  for (const ViewerGaussians& bad : {g, BallOnGround(0)}) {
    try {
      GrayModelOf(bad, "scene.ply", pool);
      FAIL();
    } catch (const Error& e) {
      EXPECT_THAT(e.what(), testing::HasSubstr("scene.ply holds no Gaussian"));
    }
  }
}

}  // namespace
}  // namespace color3d
