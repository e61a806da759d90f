#include "core/base/random.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(Random, IsReproducibleAndResumable) {
  Random first(7);
  Random second(7);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(first.NextUint32(), second.NextUint32());
  Random resumed(first.state());
  EXPECT_EQ(first.NextUint32(), resumed.NextUint32());
  double mean = 0.0;
  double square = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const double x = first.NextNormal();
    mean += x / 20000;
    square += x * x / 20000;
  }
  EXPECT_NEAR(mean, 0.0, 0.03);
  EXPECT_NEAR(square, 1.0, 0.05);
}

}  // namespace
}  // namespace color3d
