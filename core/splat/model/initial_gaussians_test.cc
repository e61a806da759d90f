#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {
namespace {

TEST(InitialGaussiansTest, ScaleIsMeanDistanceToNeighbors) {
  Scene scene;
  EXPECT_THROW(InitialGaussians(scene), Error);
  for (const double x : {0.0, 1.0, 2.0, 3.0}) {
    SparsePoint p;
    p.position = {x, 0.0, 0.0};
    scene.points.push_back(p);
  }
  const GaussianModel m = InitialGaussians(scene);
  ASSERT_EQ(m.size(), 4u);
  EXPECT_NEAR(std::exp(m.log_scale[0]), std::sqrt((1.0 + 4.0 + 9.0) / 3.0), 1e-5);
  EXPECT_NEAR(std::exp(m.log_scale[3]), std::sqrt((1.0 + 1.0 + 4.0) / 3.0), 1e-5);
  EXPECT_NEAR(1.0 / (1.0 + std::exp(-m.opacity_logit[2])), 0.1, 1e-6);
  EXPECT_EQ(m.sh_l[1], 0.0f);
}

TEST(InitialGaussiansTest, EqualPointsAndSinglePointHavePositiveScale) {
  Scene scene;
  scene.points.resize(1);
  EXPECT_TRUE(std::isfinite(InitialGaussians(scene).log_scale[0]));
  scene.points.resize(50);
  for (const float s : InitialGaussians(scene).log_scale) EXPECT_TRUE(std::isfinite(s));
}

}  // namespace
}  // namespace color3d
