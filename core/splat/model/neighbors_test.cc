#include "core/splat/model/neighbors.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/random.h"

namespace color3d {
namespace {

TEST(NeighborTreeTest, AgreesWithExhaustiveSearch) {
  Random random(6);
  std::vector<NeighborTree::Point> points(500);
  for (auto& p : points) {
    for (float& v : p) v = static_cast<float>(random.NextNormal());
  }
  points[7] = points[8];  // duplicates
  const NeighborTree tree(points);
  std::vector<NeighborTree::Neighbor> near;
  for (int q = 0; q < 50; ++q) {
    const NeighborTree::Point query = points[q];
    tree.Find(query, 4, near);
    std::vector<float> all;
    for (const auto& p : points) {
      float d = 0.0f;
      for (int k = 0; k < 3; ++k) d += (p[k] - query[k]) * (p[k] - query[k]);
      all.push_back(d);
    }
    std::sort(all.begin(), all.end());
    ASSERT_EQ(near.size(), 4u);
    for (int k = 0; k < 4; ++k) EXPECT_EQ(near[k].squared_distance, all[k]);
  }
}

// Equal distances are ordered by index, independent of the tree.
TEST(NeighborTreeTest, BreaksTiesByIndex) {
  std::vector<NeighborTree::Point> points;
  for (int i = 0; i < 1000; ++i) {  // a grid of ten to each side, in a scrambled order
    const int cell = i * 387 % 1000;
    points.push_back({static_cast<float>(cell % 10),
                      static_cast<float>(cell / 10 % 10),
                      static_cast<float>(cell / 100)});
  }
  for (int i = 0; i < 40; ++i) points.push_back({0.0f, 0.0f, 0.0f});
  const NeighborTree tree(points);
  std::vector<NeighborTree::Neighbor> near;
  for (size_t q = 0; q < points.size(); q += 7) {
    std::vector<NeighborTree::Neighbor> all;
    for (size_t i = 0; i < points.size(); ++i) {
      float d = 0.0f;
      for (int k = 0; k < 3; ++k) {
        d += (points[i][k] - points[q][k]) * (points[i][k] - points[q][k]);
      }
      all.push_back({static_cast<uint32_t>(i), d});
    }
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
      return a.squared_distance < b.squared_distance;
    });
    tree.Find(points[q], 9, near);
    ASSERT_EQ(near.size(), 9u);
    for (int k = 0; k < 9; ++k) {
      EXPECT_EQ(near[k].index, all[k].index);
      EXPECT_EQ(near[k].squared_distance, all[k].squared_distance);
    }
  }
  tree.Find(points[0], 0, near);
  EXPECT_TRUE(near.empty());
  NeighborTree({}).Find(points[0], 3, near);
  EXPECT_TRUE(near.empty());
  NeighborTree({points[1]}).Find(points[0], 3, near);
  EXPECT_EQ(near.size(), 1u);
}

}  // namespace
}  // namespace color3d
