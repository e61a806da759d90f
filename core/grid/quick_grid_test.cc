#include "core/grid/quick_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/grid/halved_grid.h"

namespace color3d {
namespace {

// A smooth picture with an upright edge in the middle, which conducts little.
GridSystem SplitGrid(int width, int height) {
  GridSystem s(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int64_t i = static_cast<int64_t>(y) * width + x;
      const bool right = x + 1 < width, down = y + 1 < height;
      const auto across = [&](int other) {
        return (x < width / 2) != (other < width / 2) ? 1e-4f : 1.0f;
      };
      if (right) s.right[i] = across(x + 1);
      if (down) s.down[i] = 1.0f;
      if (right && down) s.down_right[i] = 0.7071f * across(x + 1);
      if (x > 0 && down) s.down_left[i] = 0.7071f * across(x - 1);
    }
  }
  return s;
}

struct Painted {
  std::vector<uint8_t> pinned;
  std::vector<float> target;
  explicit Painted(const GridSystem& s)
      : pinned(static_cast<size_t>(s.PixelCount()), 0), target(2 * pinned.size(), 0.0f) {}
  void Add(const GridSystem& s, int x, int y, float a) {
    for (int k = 0; k < 6; ++k) {
      const size_t i = static_cast<size_t>(y) * s.width + x + k;
      pinned[i] = 1;
      target[i] = a;
      target[i + pinned.size()] = -a;
    }
  }
};

double MeanDifference(const std::vector<float>& x, const std::vector<float>& y) {
  double sum = 0.0;
  for (size_t i = 0; i < x.size(); ++i) sum += std::abs(x[i] - y[i]);
  return sum / static_cast<double>(x.size());
}

TEST(HalvedGridTest, KeepsSpreadEdgesAndData) {
  GridSystem fine = SplitGrid(41, 30);
  fine.data.Fill(1.0f);
  const GridSystem half = HalvedGrid(fine);
  ASSERT_EQ(half.width, 21);
  ASSERT_EQ(half.height, 15);
  // A row and its diagonals conduct as before: 1 + 2 / sqrt(2).
  const int64_t inside = 5 * 21 + 4;
  EXPECT_NEAR(half.right[inside] + 2.0f * half.down_right[inside], 2.414f, 0.01f);
  EXPECT_NEAR(half.down[inside] + 2.0f * half.down_right[inside], 2.414f, 0.01f);
  // The edge between columns 19 and 20 lies between cells 9 and 10.
  EXPECT_LT(half.right[5 * 21 + 9], 1e-3f);
  EXPECT_EQ(half.right[5 * 21 + 20], 0.0f) << "beyond the border";
  double data = 0.0;
  for (int64_t i = 0; i < half.PixelCount(); ++i) data += half.data[i];
  EXPECT_EQ(data, 41 * 30);
}

TEST(QuickGridTest, FollowsPinsThatAreAddedAndTakenAway) {
  const GridSystem edges = SplitGrid(120, 90);
  ThreadPool pool(2);
  GridHierarchy exact(edges, pool, {});
  QuickGrid quick(edges, 2, pool, {});
  EXPECT_GT(quick.bytes(), exact.bytes());
  const auto difference = [&](const Painted& painted, const GridPlane* data = nullptr) {
    const GridSolution near = quick.Solve(painted.pinned, data, painted.target, {});
    const GridSolution solved =
        exact.Solve(painted.pinned, data, painted.target, {1e-6, 300}, [](int, double) {}, {});
    for (size_t i = 0; i < painted.pinned.size(); ++i) {
      if (painted.pinned[i]) {
        EXPECT_EQ(near.u[i], painted.target[i]);
      }
    }
    return MeanDifference(near.u, solved.u);
  };
  Painted painted(edges);
  painted.Add(edges, 10, 20, 40.0f);
  EXPECT_LT(difference(painted), 1.0);
  painted.Add(edges, 90, 70, -30.0f);
  EXPECT_LT(difference(painted), 1.0);
  const Painted two = painted;
  painted.Add(edges, 20, 60, 10.0f);
  EXPECT_LT(difference(painted), 1.0);
  EXPECT_LT(difference(painted), 0.3) << "the same once more";
  EXPECT_LT(difference(two), 1.0) << "undone";
  GridPlane data(120, 90);
  data.Fill(0.01f);
  EXPECT_LT(difference(two, &data), 0.5) << "held at 0";
}

TEST(QuickGridTest, DoesNotDependOnThreads) {
  const GridSystem edges = SplitGrid(90, 70);
  Painted painted(edges);
  painted.Add(edges, 10, 20, 40.0f);
  ThreadPool one(1), three(3);
  QuickGrid first(edges, 1, one, {}), second(edges, 1, three, {});
  EXPECT_EQ(first.Solve(painted.pinned, nullptr, painted.target, {}).u,
            second.Solve(painted.pinned, nullptr, painted.target, {}).u);
}

}  // namespace
}  // namespace color3d
