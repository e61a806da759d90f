#include "core/splat/motion/shared_motion.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "core/base/random.h"
#include "core/splat/motion/motion.h"

namespace color3d {
namespace {

using Eigen::Vector3d;

constexpr int kRow = 12;

struct Rigid {
  Vector3d velocity = Vector3d::Zero();
  Vector3d turn = Vector3d::Zero();
  Vector3d At(const Vector3d& p) const { return velocity + turn.cross(p); }
};

class SharedMotionTest : public testing::Test {
 protected:
  // Gaussians around `center` at a time step, with one rigid motion and `noise`.
  void AddThing(int count, const Vector3d& center, int step, const Rigid& motion, double noise) {
    const int64_t first = moving_.count();
    moving_.Resize(first + count);
    for (int64_t i = first; i < first + count; ++i) {
      const Vector3d p = center + Normal();
      Set(kPositionRow, i, p);
      Set(kRow + kVelocityRow, i, motion.At(p) + noise * Normal());
      moving_.Row(kRow + kCenterRow)[i] = static_cast<float>(step * interval_);
    }
  }
  Vector3d Normal() { return {random_.NextNormal(), random_.NextNormal(), random_.NextNormal()}; }
  void Set(int row, int64_t i, const Vector3d& v) {
    for (int k = 0; k < 3; ++k) moving_.Row(row + k)[i] = static_cast<float>(v[k]);
  }
  Vector3d Get(int row, int64_t i) const {
    return {moving_.Row(row)[i], moving_.Row(row + 1)[i], moving_.Row(row + 2)[i]};
  }
  // Mean distance of the velocities of [begin, end) from a motion.
  double Off(const Rigid& motion, int64_t begin, int64_t end) const {
    double sum = 0.0;
    for (int64_t i = begin; i < end; ++i) {
      sum += (Get(kRow + kVelocityRow, i) - motion.At(Get(kPositionRow, i))).norm();
    }
    return sum / static_cast<double>(end - begin);
  }
  void Share(double share, int threads = 2) {
    ThreadPool pool(threads);
    ShareMotion({kRow, interval_, 24, share}, pool, moving_);
  }

  double interval_ = 0.1;
  Random random_{1};
  ParameterBlock moving_ = ParameterBlock(kRow + kMotionRows, 0);
};

TEST_F(SharedMotionTest, KeepsRigidMotion) {
  const Rigid motion{{1.0, -2.0, 0.5}, {0.0, 3.0, 1.0}};
  AddThing(200, {0, 0, 10}, 0, motion, 0.0);
  Share(1.0);
  EXPECT_LT(Off(motion, 0, 200), 0.05 * Vector3d(0, 3, 1).norm());
}

TEST_F(SharedMotionTest, RemovesNoiseAndKeepsSharedMotion) {
  const Rigid motion{{1.0, -2.0, 0.5}, {0.0, 1.0, 0.0}};
  AddThing(300, {0, 0, 0}, 0, motion, 1.0);
  const double before = Off(motion, 0, 300);
  for (int k = 0; k < 40; ++k) Share(0.05);
  EXPECT_LT(Off(motion, 0, 300), 0.4 * before);
}

TEST_F(SharedMotionTest, SeparatesObjectsThatPassEachOther) {
  const Rigid right{{2.0, 0.0, 0.0}, {0, 0, 0}}, left{{-2.0, 0.0, 0.0}, {0, 0, 0}};
  AddThing(200, {0, -2, 0}, 0, right, 0.05);
  AddThing(200, {0, 2, 0}, 0, left, 0.05);
  for (int k = 0; k < 10; ++k) Share(0.05);
  EXPECT_LT(Off(right, 0, 200), 0.25);
  EXPECT_LT(Off(left, 200, 400), 0.25);
}

TEST_F(SharedMotionTest, UsesNeighborsAtAdjacentTimeSteps) {
  const Rigid motion{{20.0, 0.0, 0.0}, {0, 0, 0}};
  AddThing(3, {0, 0, 0}, 0, {}, 0.0);
  AddThing(100, Vector3d(-2, 0, 0), -1, motion, 0.0);  // is at the same position one step later
  Share(1.0);
  EXPECT_LT(Off(motion, 0, 3), 1.0);
  AddThing(3, {50, 0, 0}, 5, {}, 0.0);  // nothing is near in time
  Share(1.0);
  EXPECT_EQ(Off({}, 103, 106), 0.0) << "fewer than four keep their own";
}

// Unit time runs from -1 to 1: of 24 steps none lies at a whole number of intervals.
TEST_F(SharedMotionTest, HandlesEvenNumberOfTimeSteps) {
  interval_ = 2.0 / 23.0;
  const Vector3d velocity(100.0, 0.0, 0.0);
  for (int step = 0; step < 23; ++step) {
    const Vector3d here(0.0, 1000.0 * step, 0.0), there = here + interval_ * velocity;
    const int64_t first = moving_.count();
    AddThing(3, here, 0, {}, 0.0);                       // has no motion yet
    AddThing(60, there, 0, {velocity, {0, 0, 0}}, 0.0);  // was here one step ago
    AddThing(60, here, 0, {-velocity, {0, 0, 0}}, 0.0);  // arrived since
    for (int64_t i = first; i < moving_.count(); ++i) {
      const double t = -1.0 + (i < first + 3 ? step : step + 1) * interval_;
      const double trained = 0.02 * interval_ * random_.NextNormal();
      moving_.Row(kRow + kCenterRow)[i] = static_cast<float>(t + trained);
    }
  }
  Share(1.0);
  for (int64_t i = 0; i < moving_.count(); i += 123) {
    EXPECT_LT((Get(kRow + kVelocityRow, i) - velocity).norm(), 0.3 * velocity.norm()) << i;
  }
}

TEST_F(SharedMotionTest, IsFiniteAndIndependentOfThreads) {
  AddThing(100, {0, 0, 0}, 0, {{1, 0, 0}, {0, 0, 1}}, 0.5);
  AddThing(50, {1e6, 0, 0}, 1, {{1, 0, 0}, {0, 0, 1}}, 1e6);
  for (int64_t i = 0; i < 30; ++i) Set(kPositionRow, i, {0.0, 0.0, 0.0});   // all at one position
  for (int64_t i = 30; i < 60; ++i) moving_.Row(kOpacityRow)[i] = -200.0f;  // invisible
  const ParameterBlock before = moving_;
  Share(0.5, 1);
  const ParameterBlock one = moving_;
  moving_ = before;
  Share(0.5, 3);
  EXPECT_EQ(one.values(), moving_.values());
  for (const float value : moving_.values()) ASSERT_TRUE(std::isfinite(value));
}

}  // namespace
}  // namespace color3d
