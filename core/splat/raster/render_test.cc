#include "core/splat/raster/render.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

TEST(RenderViewTest, ReturnsLabDepthAndOpacity) {
  ThreadPool pool(2);
  GaussianModel m;
  m.channels = 3;
  m.position = {0.0f, 0.0f, 2.0f};
  m.log_scale = {-1.0f, -1.0f, -1.0f};
  m.rotation = {1.0f, 0.0f, 0.0f, 0.0f};
  m.opacity_logit = {3.0f};
  m.sh_l = {0.0f};
  m.sh_a = {0.5f};
  m.sh_b = {0.0f};
  const Camera camera{41, 31, 40.0, 40.0, 20.5, 15.5};
  const RenderedView view = RenderView(m, camera, Pose(), pool, 0.5f);
  const float alpha = 1.0f / (1.0f + std::exp(-3.0f));
  EXPECT_NEAR(view.opacity.At(0, 15, 20), alpha, 1e-4);
  EXPECT_NEAR(view.depth.At(0, 15, 20), 2.0f, 1e-4);
  EXPECT_NEAR(view.median_depth.At(0, 15, 20), 2.0f, 1e-4);
  EXPECT_EQ(view.median_depth.At(0, 0, 0), 0.0f);  // too thin there
  EXPECT_NEAR(view.lab.At(0, 15, 20), 50.0f, 1e-3);
  EXPECT_NEAR(view.lab.At(1, 15, 20), alpha * 255.0f * kShDc * 0.5f, 1e-2);
  EXPECT_NEAR(view.lab.At(2, 15, 20), 0.0f, 1e-3);
  const RenderedView empty =
      RenderView(m, camera, Pose{Eigen::Quaterniond::Identity(), {0, 0, -9}}, pool, 0.25f);
  EXPECT_NEAR(empty.lab.At(0, 0, 0), 25.0f, 1e-4);
  EXPECT_NEAR(empty.lab.At(1, 0, 0), 0.0f, 1e-4);
  EXPECT_EQ(empty.depth.At(0, 0, 0), 0.0f);
  EXPECT_EQ(empty.median_depth.At(0, 0, 0), 0.0f);
  m.sh_b.clear();
  EXPECT_THROW(RenderView(m, camera, Pose(), pool), Error);
}

// Two Gaussians, one behind the other, with the nearer one of different opacities.
TEST(RenderViewTest, MedianDepthIsWhereHalfIsOccluded) {
  ThreadPool pool(1);
  GaussianModel m;
  m.position = {0.0f, 0.0f, 2.0f, 0.0f, 0.0f, 4.0f};
  m.log_scale.assign(6, -1.0f);
  m.rotation = {1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f};
  m.opacity_logit = {-0.5f, 3.0f};
  m.sh_l = {0.0f, 0.0f};
  const Camera camera{41, 31, 40.0, 40.0, 20.5, 15.5};
  const auto drawn = [&] { return RenderView(m, camera, Pose(), pool); };
  EXPECT_NEAR(drawn().median_depth.At(0, 15, 20), 4.0f, 1e-4);
  EXPECT_NEAR(drawn().depth.At(0, 15, 20), 3.2f, 0.1f);  // in the gap between both
  m.opacity_logit[0] = 0.5f;
  EXPECT_NEAR(drawn().median_depth.At(0, 15, 20), 2.0f, 1e-4);
  m.opacity_logit = {-2.0f, -2.0f};
  EXPECT_EQ(drawn().median_depth.At(0, 15, 20), 0.0f);
}

}  // namespace
}  // namespace color3d
