#include "core/encoder/inception/inception.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/weights/safetensors.h"
#include "tests/reference/perceptual_golden.h"
#include "tests/support/networks/named_values.h"
#include "tests/support/networks/perceptual_weights.h"

namespace color3d {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

template <size_t N>
void ExpectFeatures(const Inception& network, const double (&expected)[N]) {
  const std::vector<float> features = network.Features(NamedPicture("picture", 120, 90));
  ASSERT_EQ(features.size(), N);
  for (size_t i = 0; i < N; ++i) EXPECT_NEAR(features[i], expected[i], 2e-4) << i;
}

std::string ErrorText(WeightMap weights) {
  try {
    const Inception network(std::move(weights));
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(InceptionTest, AgreesWithReferenceNetwork) {
  const Inception fid(SmallInceptionWeights(1008)), torchvision(SmallInceptionWeights(1000));
  EXPECT_EQ(fid.feature_count(), 128);
  ExpectFeatures(fid, kFidFeatures);
  ExpectFeatures(torchvision, kTorchvisionFeatures);
}

TEST(InceptionTest, ReferenceTellsPoolingApart) {
  double largest = 0.0;
  for (size_t i = 0; i < std::size(kFidFeatures); ++i) {
    largest = std::max(largest, std::abs(kFidFeatures[i] - kTorchvisionFeatures[i]));
  }
  EXPECT_GT(largest, 0.01);
}

TEST(InceptionTest, RejectsWeightsOfAnotherNetwork) {
  WeightMap weights = SmallInceptionWeights(1008);
  weights.erase("Mixed_6c.branch7x7_2.conv.weight");
  weights["Mixed_7a.branch3x3_2.bn.bias"] = {{3}, {0.0f, 0.0f, 0.0f}};
  EXPECT_THAT(ErrorText(weights),
              AllOf(HasSubstr("Mixed_6c.branch7x7_2.conv.weight"),
                    HasSubstr("Mixed_7a.branch3x3_2.bn.bias")));
  EXPECT_THAT(ErrorText(SmallAlexNetWeights()), HasSubstr("Conv2d_1a_3x3.conv.weight is missing"));
}

TEST(InceptionTest, ReadsWeightFiles) {
  const ScratchFolder folder;
  const auto path = folder.path() / "fid.safetensors";
  WriteFileAtomic(path, SerializeSafetensors(SmallInceptionWeights(1008), false));
  ExpectFeatures(*Inception::FromWeightFile(path), kFidFeatures);
}

TEST(InceptionTest, RejectsPicturesOfTwoChannels) {
  const Inception network(SmallInceptionWeights(1008));
  EXPECT_EQ(network.Features(Image(1, 1, 1, 0.5f)).size(), 128u);
  EXPECT_THROW(network.Features(Image(4, 4, 2)), Error);
}

}  // namespace
}  // namespace color3d
