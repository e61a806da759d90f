#include "core/scene/sfm/photo_similarity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

LocalFeatures RandomFeatures(int count, uint64_t seed) {
  Random random(seed);
  LocalFeatures features;
  for (int i = 0; i < count; ++i) {
    std::vector<float> row(LocalFeatures::kDimensions);
    double sum = 0.0;
    for (float& v : row) sum += std::pow(v = static_cast<float>(random.NextNormal()), 2);
    for (float v : row) features.descriptors.push_back(static_cast<float>(v / std::sqrt(sum)));
  }
  return features;
}

TEST(PhotoSimilarity, CountsSharedFeatures) {
  const LocalFeatures a = RandomFeatures(40, 1);
  LocalFeatures b = RandomFeatures(30, 2);
  EXPECT_LE(CountMutualMatches(a, b), 2);
  b.descriptors.insert(b.descriptors.end(),
                       a.descriptors.begin(),
                       a.descriptors.begin() + 12 * LocalFeatures::kDimensions);
  EXPECT_NEAR(CountMutualMatches(a, b), 12, 2);
  EXPECT_EQ(CountMutualMatches(a, b), CountMutualMatches(b, a));
  EXPECT_EQ(CountMutualMatches(a, a), 40);
  EXPECT_EQ(CountMutualMatches(a, {}), 0);
}

// Repeated structure does not match: neither of two equal features is clearly nearest.
TEST(PhotoSimilarity, IgnoresAmbiguousFeatures) {
  const LocalFeatures a = RandomFeatures(10, 1);
  LocalFeatures twice = a;
  twice.descriptors.insert(twice.descriptors.end(), a.descriptors.begin(), a.descriptors.end());
  EXPECT_EQ(CountMutualMatches(a, twice), 0);
}

TEST(PhotoSimilarity, TableIsSymmetricAndStopsWhenCancelled) {
  const std::vector<LocalFeatures> photos = {
      RandomFeatures(20, 1), RandomFeatures(20, 2), RandomFeatures(20, 1)};
  ThreadPool pool(2);
  const SimilarityTable table = CompareAll(photos, pool, {});
  EXPECT_EQ(table.At(0, 2), 20.0f);
  EXPECT_EQ(table.At(2, 0), 20.0f);
  EXPECT_EQ(table.At(1, 1), 0.0f);
  CancellationToken cancel;
  cancel.Cancel();
  EXPECT_THROW(CompareAll(photos, pool, cancel), Error);
}

}  // namespace
}  // namespace color3d
