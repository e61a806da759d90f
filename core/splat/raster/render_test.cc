#include "core/splat/raster/render.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/color/lab.h"
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

// One Gaussian with chroma of degree 3, from the front and from the side.
TEST(RenderViewTest, ChromaOfDegree3DependsOnSide) {
  ThreadPool pool(1);
  GaussianModel m;
  m.channels = 3;
  m.chroma_sh_degree = 3;
  m.position = {0.0f, 0.0f, 0.0f};
  m.log_scale = {-1.0f, -1.0f, -1.0f};
  m.rotation = {1.0f, 0.0f, 0.0f, 0.0f};
  m.opacity_logit = {3.0f};
  m.sh_l = {0.0f};
  for (int k = 0; k < 16; ++k) {
    m.sh_a.push_back(0.02f * static_cast<float>(k % 5) - 0.03f);
    m.sh_b.push_back(0.01f * static_cast<float>(k % 7));
  }
  const Camera camera{41, 31, 40.0, 40.0, 20.5, 15.5};
  const double alpha = 1.0 / (1.0 + std::exp(-3.0));
  double previous = 0.0;
  for (const double turn : {0.0, M_PI / 2.0, M_PI}) {
    Pose pose;  // looks at the origin from a distance of 2
    pose.rotation = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY());
    pose.translation = {0.0, 0.0, 2.0};
    const Eigen::Vector3d d = (pose.rotation.inverse() * Eigen::Vector3d::UnitZ());
    double basis[16], a = 0.0, b = 0.0;
    EvaluateSh(16, d.x(), d.y(), d.z(), basis);
    for (int k = 0; k < 16; ++k) {
      a += basis[k] * m.sh_a[k];
      b += basis[k] * m.sh_b[k];
    }
    const RenderedView view = RenderView(m, camera, pose, pool);
    EXPECT_NEAR(view.lab.At(1, 15, 20), alpha * 255.0 * a, 1e-2);
    EXPECT_NEAR(view.lab.At(2, 15, 20), alpha * 255.0 * b, 1e-2);
    EXPECT_GT(std::abs(a - previous), 1e-3);
    previous = a;
  }
}

TEST(RenderViewTest, ConvertsSrgbModelToLab) {
  ThreadPool pool(1);
  GaussianModel m;
  m.color_space = ColorSpace::kSrgb;
  m.channels = 3;
  m.position = {0.0f, 0.0f, 2.0f};
  m.log_scale = {-1.0f, -1.0f, -1.0f};
  m.rotation = {1.0f, 0.0f, 0.0f, 0.0f};
  m.opacity_logit = {9.0f};
  m.sh_l = {0.9f};
  m.sh_a = {-0.3f};
  m.sh_b = {-5.0f};  // below zero: no blue
  const Camera camera{41, 31, 40.0, 40.0, 20.5, 15.5};
  const RenderedView view = RenderView(m, camera, Pose(), pool, 0.5f);
  const double alpha = view.opacity.At(0, 15, 20);
  const double gray = SrgbFromLab(LabColor{50.0, 0.0, 0.0}).g;
  const auto blended = [&](double sh) {
    return alpha * std::max(0.0, 0.5 + kShDc * sh) + (1.0 - alpha) * gray;
  };
  const LabColor expected = LabFromSrgb(RgbColor{blended(0.9), blended(-0.3), blended(-5.0)});
  EXPECT_NEAR(view.lab.At(0, 15, 20), expected.l, 0.02);
  EXPECT_NEAR(view.lab.At(1, 15, 20), expected.a, 0.05);
  EXPECT_NEAR(view.lab.At(2, 15, 20), expected.b, 0.05);
  const RenderedView empty =
      RenderView(m, camera, Pose{Eigen::Quaterniond::Identity(), {0, 0, -9}}, pool, 0.5f);
  EXPECT_NEAR(empty.lab.At(0, 0, 0), 50.0f, 1e-2);
  m.channels = 1;
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
