#include "core/matching/view_noise.h"

#include <gtest/gtest.h>
#include <torch/types.h>

namespace color3d {
namespace {

constexpr int64_t kCells = 1500;

// Places on a grid, 0.1 radii apart, moved by `offset` along x.
torch::Tensor Positions(double offset) {
  const torch::Tensor cells = torch::arange(kCells);
  const torch::Tensor x = cells.remainder(50) * 0.1 + offset;
  const torch::Tensor y = torch::floor(cells / 50) * 0.1;
  return torch::stack({x, y, torch::zeros_like(x), torch::ones_like(x)}, 1).to(torch::kFloat32);
}

// What the places look like in one view: the places' own features, and noise with these deviations.
std::vector<torch::Tensor> View(const torch::Tensor& places, const torch::Tensor& deviations) {
  return {places + torch::randn({kCells, places.size(1)}) * deviations};
}

class ViewNoiseTest : public testing::Test {
 protected:
  ViewNoiseTest() { torch::manual_seed(5); }
  const torch::Tensor places_ = torch::randn({kCells, 3}) * 10.0;
  const torch::Tensor deviations_ = torch::tensor({1.0f, 2.0f, 0.5f});
};

TEST_F(ViewNoiseTest, IsCovarianceBetweenViewsOfPlace) {
  ViewNoise noise;
  Random random(1);
  const torch::Tensor positions = Positions(0.0), near = Positions(0.01);
  for (int i = 0; i < 8; ++i) {
    const auto x = View(places_, deviations_), y = View(places_, deviations_);
    noise.Add({x, positions}, {y, near}, random);
  }
  ASSERT_EQ(noise.pairs(), 8000);
  const auto covariances = noise.Covariances();
  ASSERT_EQ(covariances.size(), 1u);
  const torch::Tensor expected = torch::diag(deviations_.square()).to(torch::kFloat64);
  EXPECT_LT((covariances[0] - expected).abs().max().item<double>(), 0.15);
}

TEST_F(ViewNoiseTest, IgnoresDistantAndUnknownPlaces) {
  ViewNoise noise;
  Random random(1);
  const auto x = View(places_, deviations_), y = View(places_, deviations_);
  const torch::Tensor positions = Positions(0.0), apart = Positions(0.05);
  noise.Add({x, positions}, {y, apart}, random);
  const torch::Tensor unknown = torch::zeros({kCells, 4});
  noise.Add({x, positions}, {y, unknown}, random);
  noise.Add({x, unknown}, {y, positions}, random);
  EXPECT_EQ(noise.pairs(), 0);
  EXPECT_TRUE(noise.Covariances().empty());
}

TEST_F(ViewNoiseTest, IsEmptyForTooFewPairs) {
  ViewNoise noise;
  Random random(1);
  const auto x = View(places_, deviations_), y = View(places_, deviations_);
  const torch::Tensor positions = Positions(0.0);
  noise.Add({x, positions}, {y, positions}, random);
  EXPECT_EQ(noise.pairs(), 1000);
  EXPECT_TRUE(noise.Covariances().empty());
}

}  // namespace
}  // namespace color3d
