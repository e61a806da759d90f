#include "core/metrics/consistency.h"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "core/base/error.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/metrics/rank_correlation.h"

namespace color3d {
namespace {

// A camera that looks along z from (x, 0, 0), turned by `yaw` about y.
PosedDepth View(double x, double yaw, int width = 64, int height = 48) {
  PosedDepth view;
  view.camera = {width, height, 60.0, 62.0, 0.5 * width, 0.5 * height};
  view.cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()));
  view.cam_from_world.translation = -(view.cam_from_world.rotation * Eigen::Vector3d(x, 0, 0));
  view.depth = Image(width, height, 1);
  return view;
}

// Intersection of the pixel's ray with the slanted plane z = 4 + 0.2 x, or, with an occluder, the
// square |x| < 0.3, |y| < 0.3 at z = 2. float64.
Eigen::Vector3d Surface(const PosedDepth& view, double u, double v, bool occluder) {
  const Eigen::Vector3d center = view.cam_from_world.Center();
  const Eigen::Vector3d ray =
      view.cam_from_world.rotation.conjugate() *
      Eigen::Vector3d(
          (u - view.camera.cx) / view.camera.fx, (v - view.camera.cy) / view.camera.fy, 1.0);
  if (occluder) {
    const Eigen::Vector3d p = center + (2.0 - center.z()) / ray.z() * ray;
    if (std::abs(p.x()) < 0.3 && std::abs(p.y()) < 0.3) return p;
  }
  const double t = (4.0 + 0.2 * center.x() - center.z()) / (ray.z() - 0.2 * ray.x());
  return center + t * ray;
}

RgbColor Texture(const Eigen::Vector3d& p) {
  return {0.5 + 0.2 * std::sin(1.3 * p.x()),
          0.5 + 0.2 * std::cos(1.1 * p.y()),
          0.4 + 0.1 * std::sin(0.7 * (p.x() + p.y()))};
}

struct Seen {
  PosedDepth view;
  ColoredPicture picture;
};

Seen Look(double x, double yaw, bool occluder, double red_offset = 0.0) {
  Seen seen{View(x, yaw), {}};
  const int width = seen.view.camera.width, height = seen.view.camera.height;
  seen.picture.srgb = Image(width, height, 3);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const Eigen::Vector3d p = Surface(seen.view, u + 0.5, v + 0.5, occluder);
      seen.view.depth.At(0, v, u) = static_cast<float>(seen.view.cam_from_world.Apply(p).z());
      const RgbColor color = Texture(p);
      seen.picture.srgb.At(0, v, u) = static_cast<float>(color.r + red_offset);
      seen.picture.srgb.At(1, v, u) = static_cast<float>(color.g);
      seen.picture.srgb.At(2, v, u) = static_cast<float>(color.b);
    }
  }
  seen.picture.lab = LabFromSrgb(seen.picture.srgb);
  return seen;
}

TEST(MatchByGeometry, FindsTheSameSurfacePointOfASlantedPlane) {
  const Seen a = Look(-0.4, 0.05, false), b = Look(0.5, -0.1, false);
  const auto matches = MatchByGeometry(a.view, b.view, {});
  ASSERT_GT(matches.size(), 1500u);
  for (const PixelMatch& m : matches) {
    const Eigen::Vector3d p = Surface(a.view, m.x + 0.5, m.y + 0.5, false);
    EXPECT_LT((Surface(b.view, m.u, m.v, false) - p).norm(), 1e-4) << m.x << " " << m.y;
  }
  MatchOptions sparse;
  sparse.stride_px = 4;
  const auto fewer = MatchByGeometry(a.view, b.view, sparse);
  EXPECT_NEAR(static_cast<double>(fewer.size()), matches.size() / 16.0, 0.1 * fewer.size());
}

TEST(MatchByGeometry, OccludedPixelsDoNotMatch) {
  const Seen a = Look(-0.5, 0.0, true), b = Look(0.5, 0.0, true);
  const auto matches = MatchByGeometry(a.view, b.view, {});
  int on_occluder = 0, wrong = 0;
  for (const PixelMatch& m : matches) {
    const Eigen::Vector3d p = Surface(a.view, m.x + 0.5, m.y + 0.5, true);
    wrong += (Surface(b.view, m.u, m.v, true) - p).norm() > 1e-3;
    on_occluder += p.z() < 3.0;
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(on_occluder, 100);
  // The part of the plane that the square hides in one view has no match in the other.
  const auto without = MatchByGeometry(Look(-0.5, 0.0, false).view, Look(0.5, 0.0, false).view, {});
  EXPECT_LT(matches.size(), without.size());
}

TEST(MatchByGeometry, ViewsWithoutOverlapOrDepthHaveNoMatches) {
  const Seen a = Look(0.0, 0.0, false);
  Seen behind = Look(0.0, 0.0, false);
  behind.view.cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(3.14159, Eigen::Vector3d::UnitY()));
  EXPECT_TRUE(MatchByGeometry(a.view, behind.view, {}).empty());
  PosedDepth nothing = a.view;
  std::fill(nothing.depth.data.begin(), nothing.depth.data.end(), 0.0f);
  EXPECT_TRUE(MatchByGeometry(a.view, nothing, {}).empty());
  EXPECT_TRUE(MatchByGeometry(nothing, a.view, {}).empty());
  nothing.depth.data[7] = std::nanf("");
  EXPECT_TRUE(MatchByGeometry(nothing, a.view, {}).empty());
  nothing.depth = Image(5, 5, 1);
  EXPECT_THROW(MatchByGeometry(a.view, nothing, {}), Error);
  EXPECT_THROW(MatchByGeometry(a.view, a.view, {.stride_px = 0}), Error);
}

TEST(CompareMatches, KnownOffsetIsTheError) {
  const Seen a = Look(-0.3, 0.0, false), b = Look(0.3, 0.0, false);
  const Seen redder = Look(0.3, 0.0, false, 0.09);
  const auto matches = MatchByGeometry(a.view, b.view, {});
  const PairDifference same = CompareMatches(a.picture, b.picture, matches);
  EXPECT_EQ(same.matches, static_cast<int64_t>(matches.size()));
  EXPECT_LT(same.absolute_rgb, 2e-4);  // of bilinear sampling
  EXPECT_LT(same.delta_e00, 0.05);
  const PairDifference offset = CompareMatches(a.picture, redder.picture, matches);
  EXPECT_NEAR(offset.absolute_rgb, 0.09 / 3.0, 2e-4);
  EXPECT_NEAR(offset.squared_rgb, 0.09 * 0.09 / 3.0, 2e-5);
  double delta_e00 = 0.0;
  for (const PixelMatch& m : matches) {
    const RgbColor color = Texture(Surface(a.view, m.x + 0.5, m.y + 0.5, false));
    delta_e00 +=
        DeltaE00(LabFromSrgb(color), LabFromSrgb(RgbColor{color.r + 0.09, color.g, color.b}));
  }
  EXPECT_NEAR(offset.delta_e00, delta_e00 / static_cast<double>(matches.size()), 0.02);
  EXPECT_EQ(CompareMatches(a.picture, b.picture, {}).matches, 0);
  EXPECT_THROW(CompareMatches(a.picture, b.picture, {{0, 0, 900.0f, 1.0f}}), Error);
  EXPECT_THROW(CompareMatches(a.picture, b.picture, {{64, 0, 1.0f, 1.0f}}), Error);
}

TEST(ConsistencyPairs, HaveShortAndLongGaps) {
  EXPECT_TRUE(ConsistencyPairs({}, 24).empty());
  EXPECT_TRUE(ConsistencyPairs({1}, 24).empty());
  const auto two = ConsistencyPairs({2}, 24);
  ASSERT_EQ(two.size(), 1u);
  EXPECT_FALSE(two[0].long_gap);
  EXPECT_EQ(ConsistencyPairs({5}, 24).size(), 5u);  // 4 short ones, first and last
  EXPECT_EQ(ConsistencyPairs({20}, 24).size(), 19u + 13u);
  const auto many = ConsistencyPairs({1000}, 24);
  EXPECT_EQ(many.size(), 48u);
  for (size_t i = 0; i < many.size(); ++i) {
    EXPECT_EQ(many[i].second - many[i].first, many[i].long_gap ? 7 : 1);
    EXPECT_LT(many[i].second, 1000);
    EXPECT_GE(many[i].first, many[i == 0 ? 0 : i - 1].first);
  }
}

TEST(ConsistencyPairs, StayWithinAGroup) {
  // Views 0..3 are of one time, 4 of another, 5..6 of a third.
  const auto pairs = ConsistencyPairs({4, 1, 2}, 24);
  std::vector<std::tuple<int, int, bool>> found;
  for (const ViewPair& pair : pairs) found.emplace_back(pair.first, pair.second, pair.long_gap);
  EXPECT_EQ(found,
            (std::vector<std::tuple<int, int, bool>>{
                {0, 1, false}, {0, 3, true}, {1, 2, false}, {2, 3, false}, {5, 6, false}}));
  EXPECT_EQ(ConsistencyPairs(std::vector<int>(100, 4), 24).size(), 48u);
}

TEST(ConsistencyMeter, WeighsMatchesForMeAndPairsForTc) {
  ConsistencyMeter meter;
  EXPECT_EQ(meter.Result().pairs, 0);
  EXPECT_EQ(meter.Result().me, 0.0);
  meter.Add({0, 1, false}, {100, 0.1, 0.02, 1.0});
  meter.Add({1, 2, false}, {300, 0.3, 0.04, 5.0});
  EXPECT_NEAR(meter.Result().tc, 0.03, 1e-12);
  meter.Add({0, 7, true}, {0, 9.0, 9.0, 9.0});  // no match: does not count
  meter.Add({1, 8, true}, {100, 0.2, 0.09, 2.0});
  const Consistency c = meter.Result();
  EXPECT_EQ(c.pairs, 3);
  EXPECT_EQ(c.matches, 500);
  EXPECT_NEAR(c.me, (100 * 0.1 + 300 * 0.3 + 100 * 0.2) / 500, 1e-12);
  EXPECT_NEAR(c.me_de00, (100 * 1.0 + 300 * 5.0 + 100 * 2.0) / 500, 1e-12);
  EXPECT_NEAR(c.tc_short, 0.03, 1e-12);
  EXPECT_NEAR(c.tc_long, 0.09, 1e-12);
  EXPECT_NEAR(c.tc, 0.06, 1e-12);
}

TEST(RankCorrelation, MatchesHandComputedRanks) {
  EXPECT_NEAR(RankCorrelation({1, 2, 3, 40}, {2, 3, 50, 60}), 1.0, 1e-12);
  EXPECT_NEAR(RankCorrelation({1, 2, 3, 4}, {9, 8, 7, -1}), -1.0, 1e-12);
  // 1 - 6 sum d^2 / (n (n^2 - 1)) with d = 1, 1, 1, 1, 0.
  EXPECT_NEAR(RankCorrelation({1, 2, 3, 4, 5}, {2, 1, 4, 3, 5}), 1.0 - 24.0 / 120.0, 1e-12);
  // Ranks 1.5 1.5 3 against 1 2 3: 1.5 / sqrt(1.5 * 2).
  EXPECT_NEAR(RankCorrelation({7, 7, 9}, {1, 2, 3}), 1.5 / std::sqrt(3.0), 1e-12);
  EXPECT_EQ(RankCorrelation({1, 1, 1}, {1, 2, 3}), 0.0);
  EXPECT_EQ(RankCorrelation({}, {}), 0.0);
  EXPECT_THROW(RankCorrelation({1}, {1, 2}), Error);
  EXPECT_THROW(RankCorrelation({1, std::nanf("")}, {1, 2}), Error);
}

}  // namespace
}  // namespace color3d
