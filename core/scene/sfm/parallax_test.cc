#include "core/scene/sfm/parallax.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/base/random.h"

namespace color3d {
namespace {

// Features of 150 points in space, seen by a camera of 384 x 288 px. Some points move
// independently.
class Points {
 public:
  explicit Points(uint64_t seed) {
    Random random(seed);
    for (int i = 0; i < 150; ++i) {
      points_.emplace_back(random.NextUniform(-3, 3), random.NextUniform(-2, 2), 0.0);
      points_.back().z() = random.NextUniform(3.0, 7.0);
      std::vector<float> row(LocalFeatures::kDimensions);
      double sum = 0.0;
      for (float& v : row) sum += std::pow(v = static_cast<float>(random.NextNormal()), 2);
      for (float& v : row) v /= static_cast<float>(std::sqrt(sum));
      rows_.push_back(std::move(row));
    }
  }
  LocalFeatures Seen(const Eigen::Vector3d& from, double turn, int moving = 0) {
    LocalFeatures features;
    features.side_px = 384;
    const Eigen::Matrix3d rotation =
        Eigen::AngleAxisd(turn, Eigen::Vector3d(0.2, 1.0, 0.1).normalized()).toRotationMatrix();
    ++frame_;
    for (int i = 0; i < 150; ++i) {
      Eigen::Vector3d point = points_[i];
      if (i < moving) point.x() += 0.15 * frame_;
      const Eigen::Vector3d p = rotation * (point - from);
      const double x = 400.0 * p.x() / p.z() + noise_.NextNormal() * 0.3;
      const double y = 400.0 * p.y() / p.z() + noise_.NextNormal() * 0.3;
      if (!(p.z() > 0.1 && std::abs(x) < 192 && std::abs(y) < 144)) continue;
      features.positions.insert(features.positions.end(),
                                {static_cast<float>(x), static_cast<float>(y)});
      features.descriptors.insert(features.descriptors.end(), rows_[i].begin(), rows_[i].end());
    }
    return features;
  }

 private:
  std::vector<Eigen::Vector3d> points_;
  std::vector<std::vector<float>> rows_;
  Random noise_{9};
  int frame_ = 0;
};

ParallaxEvidence Look(const std::vector<LocalFeatures>& photos) {
  ThreadPool pool(2);
  return MeasureParallax(photos, pool, {});
}

TEST(Parallax, DetectsStaticOrRotatingCamera) {
  Points room(1);
  std::vector<LocalFeatures> still, turning;
  for (int i = 0; i < 20; ++i) {
    still.push_back(room.Seen({0, 0, 0}, 0.0, /*moving=*/30));
    turning.push_back(room.Seen({0, 0, 0}, 0.02 * i, /*moving=*/10));
  }
  for (const auto* photos : {&still, &turning}) {
    const ParallaxEvidence evidence = Look(*photos);
    EXPECT_TRUE(evidence.IsFromOnePlace()) << Describe(evidence);
    EXPECT_EQ(evidence.largest_place, 20);
  }
  EXPECT_LT(Look(still).median_shift, 0.004);
  EXPECT_GT(Look(turning).median_shift, 0.05);
  EXPECT_THAT(Describe(Look(still)), testing::HasSubstr("190 of 190 overlapping pairs"));
}

TEST(Parallax, AcceptsMovingCamera) {
  Points room(2);
  std::vector<LocalFeatures> sideways, slowly, ahead;
  for (int i = 0; i < 20; ++i) {
    sideways.push_back(room.Seen({0.1 * i - 1.0, 0.0, 0.0}, 0.01 * i));
    slowly.push_back(room.Seen({0.02 * i, 0.0, 0.0}, 0.0));  // neighbours hardly differ
    ahead.push_back(room.Seen({0.0, 0.0, 0.05 * i}, 0.0));
  }
  for (const auto* photos : {&sideways, &slowly, &ahead}) {
    const ParallaxEvidence evidence = Look(*photos);
    EXPECT_FALSE(evidence.IsFromOnePlace()) << Describe(evidence);
  }
}

TEST(Parallax, UnrelatedOrFlatPhotosAreUndecided) {
  std::vector<LocalFeatures> strangers;
  for (uint64_t i = 0; i < 6; ++i) strangers.push_back(Points(10 + i).Seen({0, 0, 0}, 0.0));
  EXPECT_FALSE(Look(strangers).IsFromOnePlace());
  EXPECT_FALSE(Look({}).IsFromOnePlace());
  EXPECT_FALSE(Look(std::vector<LocalFeatures>(5)).IsFromOnePlace());
}

}  // namespace
}  // namespace color3d
