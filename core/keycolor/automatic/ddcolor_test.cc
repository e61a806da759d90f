#include "core/keycolor/automatic/ddcolor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <torch/types.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/keycolor/automatic/folded_norms.h"
#include "core/weights/weight_file.h"
#include "tests/support/networks/synthetic_networks.h"

namespace color3d {
namespace {

WeightMap Mini() { return SyntheticDdcolorWeights(SyntheticDdcolor::Mini(), 1); }

std::string MessageOf(WeightMap weights) {
  try {
    const Ddcolor network(std::move(weights));
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    return error.what();
  }
  return "no error";
}

TEST(FoldedNormsTest, DividesByStoredSingularValue) {
  torch::manual_seed(1);
  const torch::Tensor weight = torch::randn({3, 2, 1, 2});
  const torch::Tensor u = torch::randn({3});
  const torch::Tensor v = torch::randn({4});
  double sigma = 0.0;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 4; ++c) {
      sigma +=
          u[r].item<double>() * v[c].item<double>() * weight[r][c / 2][0][c % 2].item<double>();
    }
  }
  const torch::Tensor expected = weight / sigma;
  EXPECT_LT((FoldSpectralNorm(weight, u, v) - expected).abs().max().item<double>(), 1e-5);
  // The order of the columns is the plain one even when the weight lies channels-last in memory.
  const torch::Tensor last = weight.contiguous(at::MemoryFormat::ChannelsLast);
  EXPECT_LT((FoldSpectralNorm(last, u, v) - expected).abs().max().item<double>(), 1e-5);
}

TEST(FoldedNormsTest, FoldsBatchNormToScaleAndShift) {
  const ChannelAffine folded = FoldBatchNorm(torch::tensor({2.0f}),
                                             torch::tensor({0.5f}),
                                             torch::tensor({3.0f}),
                                             torch::tensor({4.0f - 1e-5f}));
  EXPECT_NEAR(folded.scale.item<double>(), 1.0, 1e-6);
  EXPECT_NEAR(folded.shift.item<double>(), 0.5 - 3.0, 1e-6);
}

TEST(DdcolorTest, ListsEveryWeightThatDoesNotFit) {
  WeightMap weights = Mini();
  weights.erase("decoder.layers.1.bn.running_var");
  weights.erase("refine_net.0.0.bias");
  weights["decoder.layers.9.extra"] = {{1}, {0.0f}};
  weights["decoder.color_decoder.decoder_norm.bias"] = {{2}, {0.0f, 0.0f}};
  const std::string message = MessageOf(std::move(weights));
  EXPECT_THAT(message, testing::HasSubstr("decoder.layers.1.bn.running_var"));
  EXPECT_THAT(message, testing::HasSubstr("refine_net.0.0.bias"));
  EXPECT_THAT(message, testing::HasSubstr("decoder.layers.9.extra"));
  EXPECT_THAT(message, testing::HasSubstr("decoder_norm.bias"));
}

TEST(DdcolorTest, RefusesEachMissingWeight) {
  const WeightMap all = Mini();
  for (const auto& [name, array] : all) {
    if (name.ends_with("num_batches_tracked") || name == "mean" || name == "std" ||
        name.starts_with("encoder.arch.norm.")) {
      continue;
    }
    WeightMap weights = all;
    weights.erase(name);
    EXPECT_NE(MessageOf(std::move(weights)), "no error") << name;
  }
}

TEST(DdcolorTest, RefusesNormsThatCannotBeFolded) {
  WeightMap zero = Mini();
  for (float& value : zero["decoder.layers.0.conv.0.weight_u"].values) value = 0.0f;
  EXPECT_THAT(MessageOf(std::move(zero)), testing::HasSubstr("decoder.layers.0.conv.0"));
  WeightMap negative = Mini();
  negative["decoder.layers.2.conv.2.running_var"].values[3] = -1.0f;
  EXPECT_THAT(MessageOf(std::move(negative)), testing::HasSubstr("decoder.layers.2.conv.2"));
}

TEST(DdcolorTest, ColorsPicturesOfAnySize) {
  const Ddcolor network(Mini());
  Random random(1);
  for (const auto& [width, height] :
       {std::pair{1, 1}, std::pair{37, 90}, std::pair{700, 300}, std::pair{300, 700}}) {
    Image luminance(width, height, 1);
    for (float& value : luminance.data) value = static_cast<float>(random.NextUniform(0, 100));
    const AutomaticColor color = network.Colorize(luminance);
    EXPECT_EQ(color.ab.width, width);
    EXPECT_EQ(color.ab.height, height);
    EXPECT_EQ(color.ab.channels, 2);
    EXPECT_EQ(color.confidence.data, std::vector<float>(luminance.data.size(), 1.0f));
    for (const float value : color.ab.data) ASSERT_TRUE(std::isfinite(value));
  }
  EXPECT_THROW(network.Colorize(Image(4, 4, 3)), Error);
  EXPECT_THROW(network.Colorize(Image(4, 4, 1, NAN)), Error);
  EXPECT_THROW(network.Predict(Image(33, 32, 3)), Error);
}

TEST(DdcolorTest, SyntheticModelHasPublishedKeys) {
  const std::filesystem::path list =
      std::filesystem::path(COLOR3D_SHARED_DATA) / "../reference/keys/ddcolor_tiny.tsv";
  std::ifstream file(list);
  if (!file) GTEST_SKIP() << "no key list";
  // A small model of the same layout; only names are compared.
  SyntheticDdcolor sizes = SyntheticDdcolor::Mini();
  sizes.depths = SyntheticDdcolor().depths;
  sizes.layers = SyntheticDdcolor().layers;
  const WeightMap weights = SyntheticDdcolorWeights(sizes, 1);
  std::string line;
  std::getline(file, line);
  size_t count = 0;
  while (std::getline(file, line)) {
    const std::string name = line.substr(0, line.find('\t'));
    EXPECT_EQ(weights.count(name), 1u) << name;
    ++count;
  }
  EXPECT_EQ(weights.size(), count);
}

// The expected values are those of the authors' code on random weights.
TEST(DdcolorTest, AgreesWithAuthorsNetwork) {
  const std::filesystem::path golden = std::filesystem::path(COLOR3D_SHARED_DATA) / "golden";
  if (!std::filesystem::exists(golden)) GTEST_SKIP() << "no golden data";
  const WeightMap expected = ReadWeightFile(golden / "ddcolor_mini.expected.safetensors");
  Image input(64, 64, 3);
  input.data = expected.at("input").values;
  const std::vector<float>& ab = expected.at("ab").values;
  const auto error = [&](const char* file) {
    const Image ours = Ddcolor(ReadWeightFile(golden / file)).Predict(input);
    double worst = 0.0;
    double largest = 0.0;
    for (size_t i = 0; i < ab.size(); ++i) {
      worst = std::max<double>(worst, std::abs(ours.data[i] - ab[i]));
      largest = std::max<double>(largest, std::abs(ab[i]));
    }
    return worst / largest;
  };
  EXPECT_LT(error("ddcolor_mini.safetensors"), 1e-4);
  EXPECT_LT(error("ddcolor_mini_params.pth"), 1e-4);
  EXPECT_LT(error("ddcolor_mini_raw.bin"), 1e-4);
  // The expected values come from the float32 weights: the difference is their rounding to half.
  EXPECT_LT(error("ddcolor_mini_f16.safetensors"), 2e-2);
}

}  // namespace
}  // namespace color3d
