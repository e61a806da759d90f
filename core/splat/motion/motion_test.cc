#include "core/splat/motion/motion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/splat/model/model_parameters.h"

namespace color3d {
namespace {

constexpr int kRows = 12;  // position, scale, rotation, opacity and one number of colour
constexpr int64_t kStill = 5;
constexpr int64_t kMoving = 23;

// One Gaussian that moves, in float64: parameters, then motion. Returns its rows at `t`.
std::vector<double> TwinAt(const std::vector<double>& p, double t) {
  std::vector<double> at(p.begin(), p.begin() + kRows);
  const double* m = p.data() + kRows;
  const double tau = t - m[kCenterRow], scaled = tau / std::exp(m[kLogWidthRow]);
  for (int k = 0; k < 3; ++k) {
    at[kPositionRow + k] += m[kVelocityRow + k] * tau + m[kAccelerationRow + k] * tau * tau;
  }
  for (int k = 0; k < 4; ++k) at[kRotationRow + k] += m[kSpinRow + k] * tau;
  const double opacity = std::exp(-0.5 * scaled * scaled) / (1.0 + std::exp(-p[kOpacityRow]));
  at[kOpacityRow] = std::log(opacity / (1.0 - opacity));
  return at;
}

ParameterBlock RandomRows(int rows, int64_t count, uint64_t seed) {
  ParameterBlock block(rows, count);
  Random random(seed);
  for (int r = 0; r < rows; ++r) {
    for (int64_t i = 0; i < count; ++i) block.Row(r)[i] = static_cast<float>(random.NextNormal());
  }
  return block;
}

std::vector<double> Column(const ParameterBlock& block, int64_t i) {
  std::vector<double> column;
  for (int r = 0; r < block.rows(); ++r) column.push_back(block.Row(r)[i]);
  return column;
}

class MotionTest : public testing::Test {
 protected:
  MotionTest() {
    for (int64_t i = 0; i < kMoving; ++i) {
      // Seen at all of the moments that are asked for.
      moving_.Row(kRows + kLogWidthRow)[i] = 0.2f * moving_.Row(kRows + kLogWidthRow)[i];
      moving_.Row(kRows + kCenterRow)[i] = 0.5f * moving_.Row(kRows + kCenterRow)[i];
    }
  }

  // Still ones, then moving ones at `t`.
  ParameterBlock At(float t) {
    ParameterBlock at = RandomRows(kRows, kStill + kMoving, 3);
    for (int r = 0; r < kRows; ++r) {
      for (int64_t i = 0; i < kMoving; ++i) at.Row(r)[kStill + i] = moving_.Row(r)[i];
    }
    ApplyMotion(moving_, kRows, t, kStill, pool_, at);
    return at;
  }

  ThreadPool pool_{2};
  ParameterBlock moving_ = RandomRows(kRows + kMotionRows, kMoving, 1);
};

TEST_F(MotionTest, IsThatOfItsTwinInFloat64) {
  for (const float t : {-1.0f, -0.3f, 0.0f, 1.0f}) {
    const ParameterBlock at = At(t), still = RandomRows(kRows, kStill + kMoving, 3);
    for (int64_t i = 0; i < kStill; ++i) EXPECT_EQ(Column(at, i), Column(still, i));
    for (int64_t i = 0; i < kMoving; ++i) {
      const std::vector<double> twin = TwinAt(Column(moving_, i), t), ours = Column(at, kStill + i);
      for (int r = 0; r < kRows; ++r) EXPECT_NEAR(ours[r], twin[r], 2e-5 * (1 + std::abs(twin[r])));
    }
  }
}

TEST_F(MotionTest, GradientIsThatOfItsTwinInFloat64) {
  const ParameterBlock d_at = RandomRows(kRows, kStill + kMoving, 7);
  for (const float t : {-0.7f, 0.4f}) {
    ParameterBlock gradient;
    ApplyMotionBackward(moving_, kRows, t, kStill, At(t), d_at, pool_, gradient);
    for (int64_t i = 0; i < kMoving; ++i) {
      const std::vector<double> d = Column(d_at, kStill + i), parameters = Column(moving_, i);
      const auto value = [&](const std::vector<double>& p) {
        const std::vector<double> at = TwinAt(p, t);
        double sum = 0.0;
        for (int r = 0; r < kRows; ++r) sum += d[r] * at[r];
        return sum;
      };
      for (int r = 0; r < kRows + kMotionRows; ++r) {
        constexpr double kStep = 1e-5;
        std::vector<double> up = parameters, down = parameters;
        up[r] += kStep;
        down[r] -= kStep;
        const double expected = (value(up) - value(down)) / (2.0 * kStep);
        EXPECT_NEAR(gradient.Row(r)[i], expected, 1e-4 * (1.0 + std::abs(expected)))
            << "row " << r << " of Gaussian " << i << " at " << t;
      }
    }
  }
}

TEST_F(MotionTest, FarFromItsTimeNothingIsSeenAndNothingLearnsFromIt) {
  for (int64_t i = 0; i < kMoving; ++i) {
    moving_.Row(kRows + kCenterRow)[i] = -1.0f;
    moving_.Row(kRows + kLogWidthRow)[i] = -20.0f;  // a window so narrow that its square overflows
  }
  const ParameterBlock at = At(1.0f);
  ParameterBlock d_at(kRows, kStill + kMoving), gradient;
  ApplyMotionBackward(moving_, kRows, 1.0f, kStill, at, d_at, pool_, gradient);
  for (int64_t i = 0; i < kMoving; ++i) {
    EXPECT_LT(at.Row(kOpacityRow)[kStill + i], -9.0f);
    for (int r = 0; r < gradient.rows(); ++r) EXPECT_EQ(gradient.Row(r)[i], 0.0f);
  }
}

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

TEST_F(MotionTest, OnlyTheLastGaussiansOfAModelMove) {
  const GaussianModel model = SmallModel();
  const GaussianModel at = ModelAt(model, 4.0, pool_);
  EXPECT_EQ(at.motion.size(), 0u);
  EXPECT_THAT(std::vector<float>(at.position.begin(), at.position.begin() + 12),
              testing::ElementsAreArray(model.position.begin(), model.position.begin() + 12));
  EXPECT_THAT(std::vector<float>(at.position.begin() + 15, at.position.end()),
              testing::ElementsAre(6.0f, 3.5f, 5.0f));
  EXPECT_NEAR(
      at.opacity_logit[5], std::log(1.0 / ((1.0 + std::exp(-1.0)) / std::exp(-0.5) - 1.0)), 1e-5);
  EXPECT_EQ(ModelAt(model, 3.0, pool_).position, model.position);
}

TEST_F(MotionTest, ComesBackFromAFile) {
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

TEST_F(MotionTest, ADamagedFileOrModelIsRefused) {
  GaussianModel model = SmallModel();
  std::string bytes = SerializeGaussians(model);
  bytes[40] = 9;  // more Gaussians that move than there are
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
