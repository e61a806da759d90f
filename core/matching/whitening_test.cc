#include "core/matching/whitening.h"

#include <gtest/gtest.h>
#include <torch/types.h>

namespace color3d {
namespace {

constexpr int64_t kCells = 4000;
constexpr int kStridePx = 4;

// One tap and the statistics of luminance, correlated channels.
std::vector<torch::Tensor> Blocks() {
  const torch::Tensor mixing = torch::eye(6) + 0.2 * torch::randn({6, 6});
  return {torch::mm(torch::randn({kCells, 6}), mixing) + 3.0, torch::randn({kCells, 2})};
}

class WhiteningTest : public testing::Test {
 protected:
  WhiteningTest() { torch::manual_seed(3); }
};

TEST_F(WhiteningTest, GivesEachBlockItsShareOfDistance) {
  const auto blocks = Blocks();
  const std::vector<torch::Tensor> noise{torch::eye(6, torch::kFloat64) * 0.3,
                                         torch::eye(2, torch::kFloat64)};
  WhiteningOptions options;
  options.tap_shares = {0.0, 0.25, 0.25, 0.25, 0.25};
  options.luminance_share = 2.0;
  for (const auto& view_noise : {std::vector<torch::Tensor>(), noise}) {
    const Whitening whitening(blocks, kStridePx, options, view_noise);
    const torch::Tensor variance = whitening.Apply(blocks).var(0, /*unbiased=*/false);
    // The floor of the eigenvalues reduces it a little.
    EXPECT_NEAR(variance.slice(0, 0, 6).sum().item<double>(), 0.25, 0.02);
    EXPECT_NEAR(variance.slice(0, 6, 8).sum().item<double>(), 2.0, 0.05);
  }
}

// Mahalanobis' distance under the noise, up to a factor, when no direction is left out.
TEST_F(WhiteningTest, MeasuresDistancesInUnitsOfNoise) {
  const auto blocks = Blocks();
  const torch::Tensor mixing = torch::randn({6, 6}, torch::kFloat64);
  const torch::Tensor noise = torch::mm(mixing, mixing.t()) + 0.5 * torch::eye(6, torch::kFloat64);
  const Whitening whitening(blocks, kStridePx, {}, {noise, torch::eye(2, torch::kFloat64)});
  const torch::Tensor deviation = blocks[0].to(torch::kFloat64).var(0, /*unbiased=*/false).sqrt();
  const torch::Tensor standardized = noise / torch::outer(deviation, deviation);
  const torch::Tensor softened =
      standardized + 0.005 * standardized.diagonal().mean() * torch::eye(6, torch::kFloat64);
  const torch::Tensor inverse = torch::inverse(softened);
  std::vector<double> ratios;
  for (int64_t i = 0; i < 20; ++i) {
    const torch::Tensor apart = (blocks[0][i] - blocks[0][i + 20]).to(torch::kFloat64) / deviation;
    const double expected = torch::dot(apart, torch::mv(inverse, apart)).item<double>();
    const torch::Tensor found =
        whitening.Apply({blocks[0].slice(0, i, i + 21), torch::zeros({21, 2})});
    ratios.push_back((found[0] - found[20]).square().sum().item<double>() / expected);
  }
  for (const double ratio : ratios) EXPECT_NEAR(ratio / ratios.front(), 1.0, 1e-4);
}

TEST_F(WhiteningTest, KeepsDirectionsAboveNoise) {
  // The first channel varies most, but as much between views as between places.
  const torch::Tensor tap = torch::randn({kCells, 3}) * torch::tensor({10.0f, 1.0f, 1.0f});
  const torch::Tensor noise = torch::diag(torch::tensor({100.0, 1.0, 0.01}, torch::kFloat64));
  WhiteningOptions options;
  options.dims_per_block = 1;
  const Whitening whitening({tap, torch::randn({kCells, 2})},
                            kStridePx,
                            options,
                            {noise, torch::eye(2, torch::kFloat64)});
  const torch::Tensor kept = whitening.projections()[0].matrix.select(1, 0).abs();
  EXPECT_GT(kept[2].item<double>(), 20.0 * kept[1].item<double>());
  EXPECT_GT(kept[2].item<double>(), 20.0 * 10.0 * kept[0].item<double>());
}

TEST_F(WhiteningTest, IsFiniteWithoutVarianceOrNoise) {
  const std::vector<torch::Tensor> flat{torch::ones({100, 6}), torch::ones({100, 2})};
  const auto varied = Blocks();
  const std::vector<torch::Tensor> silent{torch::zeros({6, 6}, torch::kFloat64),
                                          torch::zeros({2, 2}, torch::kFloat64)};
  for (const auto& blocks : {flat, varied}) {
    for (const auto& view_noise : {std::vector<torch::Tensor>(), silent}) {
      const Whitening whitening(blocks, kStridePx, {}, view_noise);
      EXPECT_TRUE(torch::isfinite(whitening.Apply(blocks)).all().item<bool>());
    }
  }
}

}  // namespace
}  // namespace color3d
