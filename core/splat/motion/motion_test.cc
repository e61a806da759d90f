#include "core/splat/motion/motion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/base/error.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/motion/geometry_in_time.h"

namespace color3d {
namespace {

GaussianModel SmallModel() {
  GaussianModel model;
  for (int i = 0; i < 6; ++i) {
    const auto x = static_cast<float>(i);
    model.position.insert(model.position.end(), {x, 0.5f * x, 3.0f});
    model.log_scale.insert(model.log_scale.end(), {-2.0f, -2.5f, -1.5f});
    model.rotation.insert(model.rotation.end(), {1.0f, 0.1f, 0.0f, 0.0f});
    model.opacity_logit.push_back(1.0f);
    model.sh_l.push_back(0.3f);
  }
  GaussianMotion& motion = model.motion;
  motion.begin_s = 2.0;
  motion.end_s = 4.0;
  for (int i = 0; i < 2; ++i) {
    motion.velocity.insert(motion.velocity.end(), {1.0f, 0.0f, 2.0f});
    motion.acceleration.insert(motion.acceleration.end(), {0.0f, 1.0f, 0.0f});
    motion.spin.insert(motion.spin.end(), {0.0f, 0.0f, 0.1f, 0.0f});
    motion.center.push_back(0.0f);
    motion.log_width.push_back(0.0f);
  }
  return model;
}

TEST(MotionTest, OnlyLastGaussiansMove) {
  ThreadPool pool(2);
  const GaussianModel model = SmallModel();
  const GaussianModel at = ModelAt(model, 4.0, pool);
  EXPECT_EQ(at.motion.size(), 0u);
  EXPECT_THAT(std::vector<float>(at.position.begin(), at.position.begin() + 12),
              testing::ElementsAreArray(model.position.begin(), model.position.begin() + 12));
  EXPECT_THAT(std::vector<float>(at.position.begin() + 15, at.position.end()),
              testing::ElementsAre(6.0f, 3.5f, 5.0f));
  EXPECT_NEAR(
      at.opacity_logit[5], std::log(1.0 / ((1.0 + std::exp(-1.0)) / std::exp(-0.5) - 1.0)), 1e-5);
  EXPECT_EQ(ModelAt(model, 3.0, pool).position, model.position);
}

TEST(MotionTest, RoundTripsThroughFile) {
  GaussianModel model = SmallModel();
  for (const bool confident : {false, true}) {
    if (confident) model.confidence.assign(6, 0.5f);
    const GaussianModel read = ParseGaussians(SerializeGaussians(model));
    EXPECT_EQ(read.motion.velocity, model.motion.velocity);
    EXPECT_EQ(read.motion.log_width, model.motion.log_width);
    EXPECT_EQ(read.motion.begin_s, 2.0);
    EXPECT_EQ(read.motion.end_s, 4.0);
    EXPECT_EQ(read.confidence, model.confidence);
    EXPECT_EQ(read.position, model.position);
  }
}

TEST(MotionTest, RejectsDamagedFileAndModel) {
  GaussianModel model = SmallModel();
  std::string bytes = SerializeGaussians(model);
  bytes[40] = 9;  // more moving Gaussians than Gaussians
  EXPECT_THROW(ParseGaussians(bytes), Error);
  EXPECT_THROW(ParseGaussians(SerializeGaussians(model).substr(0, 60)), Error);
  model.motion.spin.pop_back();
  EXPECT_THROW(SerializeGaussians(model), Error);
  model = SmallModel();
  model.motion.end_s = 1.0;
  EXPECT_THROW(SerializeGaussians(model), Error);
}

}  // namespace
}  // namespace color3d
