#include "core/scene/sfm/descriptor_matches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/base/random.h"

namespace color3d {
namespace {

// Descriptors of length 512, as COLMAP's.
std::string RandomDescriptor(Random* random) {
  double values[SiftDescriptors::kDimensions];
  double sum = 0.0;
  for (double& v : values) {
    v = random->NextUniform(0.0, 1.0);
    v *= v;
    sum += v * v;
  }
  std::string bytes;
  for (const double v : values) {
    bytes += static_cast<char>(std::lround(512.0 * v / std::sqrt(sum)));
  }
  return bytes;
}

TEST(DescriptorMatches, MatchesMutualUnambiguousNeighbors) {
  Random random(3);
  std::string a, b;
  for (int i = 0; i < 200; ++i) a += RandomDescriptor(&random);
  // Every second descriptor of a in reverse order, and unrelated ones.
  for (int i = 198; i >= 0; i -= 2) {
    b += a.substr(static_cast<size_t>(i) * SiftDescriptors::kDimensions,
                  SiftDescriptors::kDimensions);
  }
  for (int i = 0; i < 50; ++i) b += RandomDescriptor(&random);
  const auto matches = MatchDescriptors(SiftDescriptors(a), SiftDescriptors(b));
  ASSERT_EQ(matches.size(), 100u);
  for (size_t k = 0; k < matches.size(); ++k) {
    EXPECT_EQ(matches[k].first, static_cast<int>(2 * k));
    EXPECT_EQ(matches[k].second, static_cast<int>(99 - k));
  }
}

TEST(DescriptorMatches, AmbiguousNeighborsDoNotMatch) {
  Random random(5);
  const std::string one = RandomDescriptor(&random);
  EXPECT_EQ(MatchDescriptors(SiftDescriptors(one), SiftDescriptors(one)).size(), 1u);
  EXPECT_TRUE(MatchDescriptors(SiftDescriptors(one), SiftDescriptors(one + one)).empty());
  EXPECT_TRUE(MatchDescriptors(SiftDescriptors(one + one), SiftDescriptors(one)).empty());
}

TEST(DescriptorMatches, EmptySetsHaveNoMatches) {
  Random random(7);
  const SiftDescriptors none, one(RandomDescriptor(&random) + "rest");
  EXPECT_EQ(one.count(), 1);
  EXPECT_TRUE(MatchDescriptors(none, one).empty());
  EXPECT_TRUE(MatchDescriptors(one, none).empty());
  EXPECT_TRUE(MatchDescriptors(none, none).empty());
}

}  // namespace
}  // namespace color3d
