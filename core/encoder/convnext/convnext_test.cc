#include "core/encoder/convnext/convnext.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/random.h"
#include "core/color/lab.h"
#include "core/encoder/encoder.h"
#include "core/encoder/image_tensors.h"
#include "core/weights/weight_file.h"
#include "tests/support/networks/random_features.h"

namespace color3d {
namespace {

Image RandomLuminance(int width, int height, uint64_t seed) {
  Random random(seed);
  Image image(width, height, 1);
  for (float& value : image.data) value = static_cast<float>(random.NextUniform(0.0, 100.0));
  return image;
}

ConvNextConfig TinyConfig() {
  ConvNextConfig config;
  config.stem_kernel = 4;
  config.stem_stride = 2;
  config.dims = {4, 6};
  config.depths = {1, 2};
  return config;
}

// Weights that exercise every term, unlike random features with many zeros and ones.
WeightMap NoisyWeights(const ConvNextConfig& config) {
  WeightMap weights = RandomFeatureWeights(config, 1);
  Random random(5);
  for (auto& [name, array] : weights) {
    for (float& value : array.values) value += static_cast<float>(0.3 * random.NextNormal());
  }
  return weights;
}

// Slow float64 reference of ConvNext::Taps, after the publication (Liu et al. 2022).
class Reference {
 public:
  using Map = std::vector<std::vector<std::vector<double>>>;  // [channel][y][x]

  Reference(const ConvNextConfig& config, const WeightMap& weights)
      : config_(config), weights_(weights) {}

  std::vector<Map> Taps(Map x) const {
    std::vector<Map> taps;
    for (int i = 0; i < config_.StageCount(); ++i) {
      const std::string down = "downsample_layers." + std::to_string(i) + ".";
      if (i == 0) {
        x = Conv(x,
                 down + "0",
                 config_.stem_kernel,
                 config_.stem_stride,
                 (config_.stem_kernel - config_.stem_stride) / 2,
                 /*replicate=*/true,
                 1);
        x = Norm(x, down + "1");
      } else {
        x = Conv(Norm(x, down + "0"), down + "1", 2, 2, 0, false, 1);
      }
      for (int j = 0; j < config_.depths[i]; ++j) {
        x = Block(x, "stages." + std::to_string(i) + "." + std::to_string(j) + ".");
      }
      taps.push_back(Norm(x, "norm" + std::to_string(i)));
    }
    return taps;
  }

 private:
  double W(const std::string& name, size_t index) const {
    return weights_.at(name).values.at(index);
  }

  Map Conv(const Map& in,
           const std::string& name,
           int k,
           int stride,
           int pad,
           bool replicate,
           int groups) const {
    const int height = static_cast<int>(in[0].size());
    const int width = static_cast<int>(in[0][0].size());
    const int out_channels = static_cast<int>(weights_.at(name + ".weight").shape[0]);
    const int in_per_group = static_cast<int>(in.size()) / groups;
    const int h = (height + 2 * pad - k) / stride + 1;
    const int w = (width + 2 * pad - k) / stride + 1;
    Map out(out_channels, std::vector<std::vector<double>>(h, std::vector<double>(w)));
    for (int o = 0; o < out_channels; ++o) {
      const int first = o / (out_channels / groups) * in_per_group;
      for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
          double sum = W(name + ".bias", o);
          for (int c = 0; c < in_per_group; ++c) {
            for (int ky = 0; ky < k; ++ky) {
              for (int kx = 0; kx < k; ++kx) {
                int yy = y * stride + ky - pad;
                int xx = x * stride + kx - pad;
                if (replicate) {
                  yy = std::clamp(yy, 0, height - 1);
                  xx = std::clamp(xx, 0, width - 1);
                } else if (yy < 0 || xx < 0 || yy >= height || xx >= width) {
                  continue;
                }
                sum += W(name + ".weight", ((o * in_per_group + c) * k + ky) * k + kx) *
                       in[first + c][yy][xx];
              }
            }
          }
          out[o][y][x] = sum;
        }
      }
    }
    return out;
  }

  Map Norm(const Map& in, const std::string& name) const {
    Map out = in;
    const double n = static_cast<double>(in.size());
    for (size_t y = 0; y < in[0].size(); ++y) {
      for (size_t x = 0; x < in[0][0].size(); ++x) {
        double mean = 0.0, variance = 0.0;
        for (const auto& plane : in) mean += plane[y][x] / n;
        for (const auto& plane : in) variance += std::pow(plane[y][x] - mean, 2) / n;
        for (size_t c = 0; c < in.size(); ++c) {
          out[c][y][x] =
              (in[c][y][x] - mean) / std::sqrt(variance + 1e-6) * W(name + ".weight", c) +
              W(name + ".bias", c);
        }
      }
    }
    return out;
  }

  Map Block(const Map& in, const std::string& name) const {
    const int channels = static_cast<int>(in.size());
    const Map y = Norm(Conv(in, name + "dwconv", 7, 1, 3, false, channels), name + "norm");
    Map out = in;
    for (size_t row = 0; row < in[0].size(); ++row) {
      for (size_t column = 0; column < in[0][0].size(); ++column) {
        std::vector<double> hidden(4 * channels);
        for (int h = 0; h < 4 * channels; ++h) {
          double sum = W(name + "pwconv1.bias", h);
          for (int c = 0; c < channels; ++c) {
            sum += W(name + "pwconv1.weight", h * channels + c) * y[c][row][column];
          }
          hidden[h] = 0.5 * sum * (1.0 + std::erf(sum / std::sqrt(2.0)));
        }
        for (int c = 0; c < channels; ++c) {
          double sum = W(name + "pwconv2.bias", c);
          for (int h = 0; h < 4 * channels; ++h) {
            sum += W(name + "pwconv2.weight", c * 4 * channels + h) * hidden[h];
          }
          out[c][row][column] += W(name + "gamma", c) * sum;
        }
      }
    }
    return out;
  }

  const ConvNextConfig& config_;
  const WeightMap& weights_;
};

TEST(ConvNextTest, AgreesWithFloat64Reference) {
  const ConvNextConfig config = TinyConfig();
  const WeightMap weights = NoisyWeights(config);
  const ConvNext network(config, weights, "tiny");
  torch::NoGradGuard no_grad;
  const torch::Tensor input = network.Input(TensorFromImage(RandomLuminance(12, 8, 3)));
  Reference::Map map(3, std::vector<std::vector<double>>(8, std::vector<double>(12)));
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 12; ++x) map[c][y][x] = input[0][c][y][x].item<double>();
    }
  }
  const std::vector<torch::Tensor> taps = network.Taps(input);
  const std::vector<Reference::Map> expected = Reference(config, weights).Taps(map);
  for (int i = 0; i < 2; ++i) {
    for (size_t c = 0; c < expected[i].size(); ++c) {
      for (size_t y = 0; y < expected[i][c].size(); ++y) {
        for (size_t x = 0; x < expected[i][c][y].size(); ++x) {
          ASSERT_NEAR(taps[i][0][c][y][x].item<double>(), expected[i][c][y][x], 2e-4);
        }
      }
    }
  }
}

TEST(ConvNextTest, NormalizesGrayByImageNetStatistics) {
  Image luminance(101, 1, 1);
  for (int x = 0; x <= 100; ++x) luminance.data[x] = static_cast<float>(x);
  const ConvNext network(TinyConfig(), RandomFeatureWeights(TinyConfig(), 1), "tiny");
  const torch::Tensor input = network.Input(TensorFromImage(luminance));
  const double mean[] = {0.485, 0.456, 0.406};
  const double deviation[] = {0.229, 0.224, 0.225};
  for (int x = 0; x <= 100; ++x) {
    const double gray = GrayFromLuminance(x);
    for (int c = 0; c < 3; ++c) {
      ASSERT_NEAR(input[0][c][0][x].item<double>(), (gray - mean[c]) / deviation[c], 2e-5);
    }
  }
}

TEST(ConvNextTest, TapsHaveStridesAndAreNormalized) {
  // Untrained norms have no scale and shift of their own.
  const ConvNextConfig config;
  const auto encoder =
      std::make_shared<const ConvNext>(config, RandomFeatureWeights(config, 1), "random");
  torch::NoGradGuard no_grad;
  const torch::Tensor input = encoder->Input(TensorFromImage(RandomLuminance(96, 64, 1)));
  const std::vector<torch::Tensor> taps = encoder->Taps(input);
  ASSERT_EQ(taps.size(), 5u);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(taps[i].size(1), encoder->config().dims[i]);
    EXPECT_EQ(taps[i].size(2), 64 / encoder->config().Stride(i));
    EXPECT_EQ(taps[i].size(3), 96 / encoder->config().Stride(i));
    EXPECT_TRUE(taps[i].isfinite().all().item<bool>());
    EXPECT_LT(taps[i].mean(1).abs().max().item<double>(), 1e-4);
    EXPECT_NEAR(taps[i].square().mean().item<double>(), 1.0, 0.05);
  }
}

TEST(ConvNextTest, GivesFiniteTapsForFlatPicture) {
  const auto encoder = std::dynamic_pointer_cast<const ConvNext>(Encoder::Embedded());
  torch::NoGradGuard no_grad;
  for (float l : {0.0f, 50.0f, 100.0f}) {
    const torch::Tensor input = encoder->Input(TensorFromImage(Image(32, 32, 1, l)));
    for (const torch::Tensor& tap : encoder->Taps(input)) {
      EXPECT_TRUE(tap.isfinite().all().item<bool>());
    }
  }
}

TEST(ConvNextTest, ZeroOrNoAdapterGivesSameBytes) {
  const ConvNextConfig config = TinyConfig();
  const ConvNext network(config, NoisyWeights(config), "tiny");
  torch::NoGradGuard no_grad;
  const torch::Tensor input = network.Input(TensorFromImage(RandomLuminance(16, 16, 2)));
  const auto plain = network.Taps(input);
  const auto zeros =
      network.Taps(input, [](int, int, const torch::Tensor& x) { return torch::zeros_like(x); });
  const auto nothing =
      network.Taps(input, [](int, int, const torch::Tensor&) { return torch::Tensor(); });
  const auto ones = network.Taps(input, [](int stage, int block, const torch::Tensor& x) {
    return stage == 1 && block == 1 ? torch::randn_like(x) : torch::Tensor();
  });
  for (size_t i = 0; i < plain.size(); ++i) {
    EXPECT_TRUE(torch::equal(plain[i], zeros[i]));
    EXPECT_TRUE(torch::equal(plain[i], nothing[i]));
  }
  EXPECT_TRUE(torch::equal(plain[0], ones[0]));
  EXPECT_FALSE(torch::equal(plain[1], ones[1]));
}

TEST(ConvNextTest, DigestDependsOnArchitectureAndWeights) {
  const ConvNextConfig config = TinyConfig();
  WeightMap weights = RandomFeatureWeights(config, 1);
  const std::string digest = ConvNext(config, weights, "a").digest();
  EXPECT_TRUE(IsSha256Hex(digest));
  EXPECT_EQ(ConvNext(config, RandomFeatureWeights(config, 1), "b").digest(), digest);
  EXPECT_NE(ConvNext(config, RandomFeatureWeights(config, 2), "a").digest(), digest);
  weights["norm0.bias"].values[0] += 1e-3f;
  EXPECT_NE(ConvNext(config, weights, "a").digest(), digest);
  EXPECT_EQ(Encoder::Embedded()->digest(), Encoder::Embedded()->digest());
}

TEST(ConvNextTest, RefusesWeightsThatDoNotFit) {
  const ConvNextConfig config = TinyConfig();
  WeightMap missing = RandomFeatureWeights(config, 1);
  missing.erase("norm1.weight");
  EXPECT_THROW(ConvNext(config, missing, ""), Error);
  WeightMap extra = RandomFeatureWeights(config, 1);
  extra["head.weight"] = {{1}, {0.0f}};
  EXPECT_THROW(ConvNext(config, extra, ""), Error);
  WeightMap reshaped = RandomFeatureWeights(config, 1);
  reshaped["norm1.weight"] = {{3}, {0.0f, 0.0f, 0.0f}};
  EXPECT_THROW(ConvNext(config, reshaped, ""), Error);
}

TEST(ConvNextTest, AgreesWithAuthorsNetwork) {
  const std::filesystem::path golden = std::filesystem::path(COLOR3D_SHARED_DATA) / "golden";
  if (!std::filesystem::exists(golden)) GTEST_SKIP() << "no golden data";
  ConvNextConfig config;
  config.stem_kernel = config.stem_stride = 4;
  config.dims = {16, 32, 64, 128};
  config.depths = {1, 1, 2, 1};
  const std::string prefix = "encoder.arch.";
  WeightMap weights;
  for (auto& [name, array] : ReadWeightFile(golden / "ddcolor_mini.safetensors")) {
    const bool ours = name.rfind(prefix, 0) == 0 && name.find("arch.norm.") == std::string::npos &&
                      name.find("arch.head") == std::string::npos;
    if (ours) weights[name.substr(prefix.size())] = array;
  }
  const ConvNext network(config, weights, "mini");
  const WeightMap expected = ReadWeightFile(golden / "ddcolor_mini.expected.safetensors");
  torch::NoGradGuard no_grad;
  auto tensor = [&](const std::string& name) {
    const WeightArray& array = expected.at(name);
    return torch::tensor(array.values).view(array.shape);
  };
  const torch::Tensor mean = torch::tensor({0.485f, 0.456f, 0.406f}).view({1, 3, 1, 1});
  const torch::Tensor deviation = torch::tensor({0.229f, 0.224f, 0.225f}).view({1, 3, 1, 1});
  const auto taps = network.Taps((tensor("input") - mean) / deviation);
  for (int i = 0; i < 4; ++i) {
    EXPECT_LT((taps[i] - tensor("norm" + std::to_string(i))).abs().max().item<double>(), 1e-4);
  }
}

}  // namespace
}  // namespace color3d
