#include "core/carry/view_propagation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace color3d {
namespace {

constexpr int kWidth = 96, kHeight = 64;

// A smooth pattern without repetition, seen from `shift` px further right.
Image Pattern(double shift) {
  Image luminance(kWidth, kHeight, 1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double u = x + shift;
      luminance.At(0, y, x) = static_cast<float>(50.0 + 20.0 * std::sin(0.11 * u + 0.002 * u * u) +
                                                 20.0 * std::cos(0.23 * y + 0.05 * u));
    }
  }
  return luminance;
}

// a is 40 right of `edge` px, else -40; b is 10.
Image TwoColors(double edge) {
  Image ab(kWidth, kHeight, 2, 10.0f);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) ab.At(0, y, x) = x >= edge ? 40.0f : -40.0f;
  }
  return ab;
}

Scene SceneOf(int views) {
  Scene scene;
  for (int i = 0; i < views; ++i) {
    View view;
    view.name = "p" + std::to_string(i);
    scene.views.push_back(view);
  }
  return scene;
}

void AddPoints(int count, std::vector<int> views, Scene* scene) {
  for (int i = 0; i < count; ++i) {
    SparsePoint point;
    point.views = views;
    scene->points.push_back(point);
  }
}

// Consecutive views share 60 points; of three, the first and the last share 5.
Scene Chain(int views) {
  Scene scene = SceneOf(views);
  for (int i = 0; i + 1 < views; ++i) AddPoints(60, {i, i + 1}, &scene);
  for (int i = 0; i + 2 < views; ++i) AddPoints(5, {i, i + 2}, &scene);
  return scene;
}

TEST(PropagateByFlowTest, BringsColorsToEndOfChain) {
  constexpr double kStep = 3.0;
  CarriedColor color{TwoColors(60.0), Image(kWidth, kHeight, 1, 1.0f)};
  for (int i = 0; i < 4; ++i) {
    color = PropagateByFlow(color, Pattern(kStep * i), Pattern(kStep * (i + 1)), {});
  }
  // The edge has moved by 12 px to the left.
  const Image expected = TwoColors(48.0);
  double error = 0.0;
  int pixels = 0, known = 0;
  for (int y = 8; y < kHeight - 8; ++y) {
    for (int x = 8; x < kWidth - 20; ++x) {
      known += color.confidence.At(0, y, x) > 0.5f ? 1 : 0;
      ++pixels;
      if (std::abs(x - 48) < 4) continue;
      error += std::abs(color.ab.At(0, y, x) - expected.At(0, y, x));
    }
  }
  EXPECT_LT(error / pixels, 2.0);
  EXPECT_GT(known, 0.9 * pixels);
  EXPECT_EQ(color.confidence.At(0, kHeight / 2, kWidth - 1), 0.0f) << "it was never in the picture";
}

TEST(PropagateByFlowTest, FadesWhereFlowDisagrees) {
  const CarriedColor color{Image(kWidth, kHeight, 2, 25.0f), Image(kWidth, kHeight, 1, 1.0f)};
  Image target = Pattern(0.0);
  for (int y = 20; y < 44; ++y) {
    for (int x = 30; x < 60; ++x) {  // an object that the source does not show
      target.At(0, y, x) = (x * 7 + y * 13) % 17 > 8 ? 95.0f : 5.0f;
    }
  }
  const CarriedColor got = PropagateByFlow(color, Pattern(0.0), target, {});
  float palest = 25.0f;
  double traced = 0.0;
  int pixels = 0;
  for (size_t i = 0; i < got.confidence.data.size(); ++i) {
    const float a = got.ab.Plane(0)[i];
    if (got.confidence.data[i] < 0.01f) palest = std::min(palest, a);
    if (got.confidence.data[i] < 0.99f) continue;
    traced += a;
    ++pixels;
  }
  ASSERT_GT(pixels, kWidth * kHeight / 4);
  EXPECT_NEAR(traced / pixels, 25.0, 0.5);
  EXPECT_LT(palest, 15.0f) << "a pixel between edges";
}

TEST(PropagateByFlowTest, ResizesSourceToTarget) {
  const CarriedColor color{Image(48, 32, 2, 25.0f), Image(48, 32, 1, 1.0f)};
  Image small(48, 32, 1);
  const Image target = Pattern(0.0);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 48; ++x) small.At(0, y, x) = target.At(0, 2 * y, 2 * x);
  }
  const CarriedColor got = PropagateByFlow(color, small, target, {});
  ASSERT_EQ(got.ab.width, kWidth);
  EXPECT_NEAR(got.ab.At(0, kHeight / 2, kWidth / 2), 25.0f, 0.5f);
}

TEST(PlanPropagationTest, PrefersManySimilarViewsToOneLeap) {
  const PropagationPlan plan = PlanPropagation(Chain(5), {0}, false);
  EXPECT_EQ(plan.source, (std::vector<int>{-1, 0, 1, 2, 3}));
  EXPECT_EQ(plan.levels, (std::vector<std::vector<int>>{{0}, {1}, {2}, {3}, {4}}));
  EXPECT_TRUE(plan.unconnected.empty());
}

TEST(PlanPropagationTest, StartsAtNearestKeyView) {
  const PropagationPlan plan = PlanPropagation(Chain(6), {0, 5}, false);
  EXPECT_EQ(plan.source, (std::vector<int>{-1, 0, 1, 4, 5, -1}));
}

TEST(PlanPropagationTest, LeavesOutUnconnectedViews) {
  Scene scene = Chain(4);
  scene.views.push_back(scene.views[0]);
  AddPoints(10, {4}, &scene);
  const PropagationPlan plan = PlanPropagation(scene, {1}, false);
  EXPECT_EQ(plan.unconnected, std::vector<int>{4});
  size_t reached = 0;
  for (const auto& level : plan.levels) reached += level.size();
  EXPECT_EQ(reached, 4u) << "every connected view once";
}

TEST(PlanPropagationTest, PassesThroughNoHeldOutPhoto) {
  Scene scene = Chain(4);
  scene.views[2].held_out = true;
  const PropagationPlan plan = PlanPropagation(scene, {0}, false);
  EXPECT_EQ(plan.source, (std::vector<int>{-1, 0, 1, 1})) << "3 leaps over 2";
}

TEST(PlanPropagationTest, FollowsShotsOfFilm) {
  Scene scene = SceneOf(6);
  for (int i = 0; i < 6; ++i) scene.views[i].moment = Moment{0.1 * i, i < 4 ? 0 : 1};
  scene.views[2].held_out = true;
  const PropagationPlan plan = PlanPropagation(scene, {1}, true);
  EXPECT_EQ(plan.source, (std::vector<int>{1, -1, 1, 2, -1, -1}));
  EXPECT_EQ(plan.unconnected, (std::vector<int>{4, 5})) << "behind the cut";
}

TEST(PlanPropagationTest, CrossesToCamerasOfSameTime) {
  Scene scene = SceneOf(4);
  for (int i = 0; i < 4; ++i) scene.views[i].moment = Moment{0.1 * (i % 2), i / 2};
  AddPoints(10, {0, 1, 2, 3}, &scene);
  AddPoints(10, {0}, &scene);
  AddPoints(10, {2}, &scene);
  const PropagationPlan plan = PlanPropagation(scene, {0}, true);
  EXPECT_EQ(plan.source, (std::vector<int>{-1, 0, 3, 1})) << "where they overlap most";
}

}  // namespace
}  // namespace color3d
