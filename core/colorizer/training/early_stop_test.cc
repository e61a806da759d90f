#include "core/colorizer/training/early_stop.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(EarlyStopTest, StopsWhenCurveIsFlat) {
  EarlyStop falling({.min_improvement = 0.01});
  double error = 10.0;
  for (int i = 0; i < 40; ++i) EXPECT_FALSE(falling.Add(error *= 0.99)) << i;
  EarlyStop flat({.min_improvement = 0.01});
  for (int i = 0; i < 6; ++i) EXPECT_FALSE(flat.Add(5.0)) << i;
  EXPECT_TRUE(flat.Add(5.0));
  EarlyStop off({.min_improvement = 0.0});
  for (int i = 0; i < 40; ++i) EXPECT_FALSE(off.Add(5.0 + i));
}

}  // namespace
}  // namespace color3d
