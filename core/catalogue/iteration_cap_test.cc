#include "core/catalogue/iteration_cap.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(IterationCapTest, GrowsWithViews) {
  EXPECT_EQ(IterationCap(800, 3), 800);
  EXPECT_EQ(IterationCap(1200, 3), 1000);
  EXPECT_EQ(IterationCap(1500, 3), 1000);
  EXPECT_EQ(IterationCap(1500, 20), 1304);
  EXPECT_EQ(IterationCap(1500, 23), 1500);
  EXPECT_EQ(IterationCap(5000, 3), 1500);
  EXPECT_EQ(IterationCap(5000, 12), 1800);
  EXPECT_EQ(IterationCap(5000, 50), 5000);
  EXPECT_EQ(IterationCap(100'000, 1'000'000'000), 100'000);
}

}  // namespace
}  // namespace color3d
