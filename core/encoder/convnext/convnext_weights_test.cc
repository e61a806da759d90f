#include "core/encoder/convnext/convnext_weights.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/base/error.h"
#include "tests/support/networks/random_features.h"

namespace color3d {
namespace {

ConvNextConfig PublishedStem() {
  ConvNextConfig config;
  config.stem_kernel = config.stem_stride = 4;
  config.dims = {8, 16};
  config.depths = {1, 3};
  return config;
}

TEST(ConvNextWeightsTest, ReadsSizesFromShapes) {
  WeightMap weights = RandomFeatureWeights(PublishedStem(), 1);
  weights["head.weight"] = {{1}, {0.0f}};
  weights["norm.bias"] = {{1}, {0.0f}};
  const ConvNextWeights found = TakeConvNextWeights(weights);
  EXPECT_EQ(found.config.ToString(), PublishedStem().ToString());
  EXPECT_EQ(found.weights.count("head.weight"), 0u);
  EXPECT_EQ(found.weights.count("norm.bias"), 0u);
  EXPECT_TRUE(weights.empty());
}

TEST(ConvNextWeightsTest, RemovesPrefixAndKeepsOtherArrays) {
  WeightMap weights;
  for (const auto& [name, array] : RandomFeatureWeights(PublishedStem(), 1)) {
    weights["encoder.arch." + name] = array;
  }
  weights["decoder.x"] = {{1}, {0.0f}};
  weights["zzz"] = {{1}, {0.0f}};
  const ConvNextWeights found = TakeConvNextWeights(weights);
  EXPECT_EQ(found.config.dims, PublishedStem().dims);
  EXPECT_EQ(weights.size(), 2u);
}

TEST(ConvNextWeightsTest, AddsIdentityNormsToTaps) {
  WeightMap weights = RandomFeatureWeights(PublishedStem(), 1);
  std::erase_if(weights, [](const auto& item) { return item.first.starts_with("norm"); });
  const ConvNextWeights found = TakeConvNextWeights(weights);
  EXPECT_EQ(found.weights.at("norm1.weight").values, std::vector<float>(16, 1.0f));
  EXPECT_EQ(found.weights.at("norm1.bias").values, std::vector<float>(16, 0.0f));
  EXPECT_THAT(found.description, testing::HasSubstr("without scale"));
}

TEST(ConvNextWeightsTest, RefusesOtherStems) {
  WeightMap none;
  EXPECT_THROW(TakeConvNextWeights(none), Error);
  WeightMap stem = RandomFeatureWeights(PublishedStem(), 1);
  stem["downsample_layers.0.0.weight"] = {{8, 3, 7, 7}, std::vector<float>(8 * 147)};
  EXPECT_THROW(TakeConvNextWeights(stem), Error);
  WeightMap huge = RandomFeatureWeights(PublishedStem(), 1);
  huge["downsample_layers.1.1.weight"] = {{int64_t{1} << 40, 0, 2, 2}, {}};
  EXPECT_THROW(TakeConvNextWeights(huge), Error);
}

}  // namespace
}  // namespace color3d
