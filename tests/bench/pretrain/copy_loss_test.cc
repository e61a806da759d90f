#include "tests/bench/pretrain/copy_loss.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include "core/matching/cell_features.h"

namespace color3d {
namespace {

constexpr int64_t kSide = 64;

// View with taps at strides 4 and 8, and 3 colours.
ConvNextConfig TwoTaps() {
  ConvNextConfig config;
  config.stem_stride = 4;
  config.dims = {20, 24};
  config.depths = {0, 0};
  return config;
}

CopyView RandomView() {
  const int64_t cells = kSide / kCellPx;
  CopyView view;
  view.taps = {torch::randn({1, 20, cells, cells}), torch::randn({1, 24, cells / 2, cells / 2})};
  view.luminance = torch::rand({1, 1, kSide, kSide}) * 100.0;
  view.colors = torch::softmax(torch::randn({cells * cells, 3}) * 5.0, 1);
  return view;
}

// Matches of a view with itself.
torch::Tensor SamePlaces() {
  const int64_t cells = kSide / kCellPx;
  const torch::Tensor at = (torch::arange(cells, torch::kFloat32) + 0.5) * kCellPx;
  return torch::stack({at.repeat({cells}), at.unsqueeze(1).expand({cells, cells}).flatten()}, 1);
}

TEST(CopyLossTest, UsesSpaceOfMatching) {
  torch::manual_seed(1);
  const torch::Tensor mix = torch::randn({24, 24});
  const torch::Tensor cells = torch::mm(torch::randn({300, 24}), mix);
  const torch::Tensor flat = torch::randn({300, 7});
  const Whitening whitening({cells, flat}, 8, {});
  const torch::Tensor used = whitening.Apply({cells, flat});
  const torch::Tensor ours =
      torch::cat({WhitenBlock(cells, cells, 16, 1.0), WhitenBlock(flat, flat, 16, 1.0)}, 1);
  EXPECT_TRUE(torch::allclose(
      SquaredDistances(ours, ours), SquaredDistances(used, used), /*rtol=*/1e-3, /*atol=*/1e-3));
}

TEST(CopyLossTest, AcceptsFewerSamplesThanChannels) {
  torch::manual_seed(2);
  const torch::Tensor samples = torch::randn({12, 40});
  const torch::Tensor white = WhitenBlock(samples, samples, 8, 2.0);
  ASSERT_EQ(white.sizes(), (std::vector<int64_t>{12, 8}));
  // Nearly white: each dimension has its share of the distance.
  EXPECT_LT((white.square().mean(0) - 2.0 / 8).abs().max().item<float>(), 0.02f);
}

TEST(CopyLossTest, SameViewHasLowerLossThanAnother) {
  torch::manual_seed(3);
  const CopyView view = RandomView();
  CopyView other = RandomView();
  other.colors = view.colors;
  const torch::Tensor weights = torch::ones({3});
  CopyLossOptions options;
  options.match_sigma_px = 1.0;  // the cell itself
  Random random(1);
  const CopyLosses same = CopyColors(TwoTaps(), view, view, SamePlaces(), weights, options, random);
  const CopyLosses wrong =
      CopyColors(TwoTaps(), view, other, SamePlaces(), weights, options, random);
  const double entropy = -(view.colors * view.colors.log()).sum(1).mean().item<double>();
  EXPECT_NEAR(same.copy.item<double>(), entropy, 0.1);
  EXPECT_GT(wrong.copy.item<double>(), entropy + 0.5);
  EXPECT_LT(same.contrast.item<double>(), 0.5 * wrong.contrast.item<double>());
}

TEST(CopyLossTest, HasNoContrastWithoutMatches) {
  torch::manual_seed(4);
  const CopyView view = RandomView();
  Random random(1);
  const CopyLosses losses = CopyColors(TwoTaps(),
                                       view,
                                       RandomView(),
                                       torch::full({kSide * kSide / 16, 2}, -1.0f),
                                       torch::ones({3}),
                                       {},
                                       random);
  EXPECT_EQ(losses.contrast.item<double>(), 0.0);
}

TEST(CopyLossTest, DescentImprovesCopiedColors) {
  torch::manual_seed(5);
  CopyView first = RandomView(), second = RandomView();
  for (CopyView* view : {&first, &second}) {
    for (torch::Tensor& tap : view->taps) tap.set_requires_grad(true);
  }
  const auto loss = [&] {
    Random random(1);
    return CopyColors(TwoTaps(), first, second, SamePlaces(), torch::ones({3}), {}, random).copy;
  };
  const double before = loss().item<double>();
  for (int i = 0; i < 40; ++i) {
    loss().backward();
    torch::NoGradGuard no_grad;
    for (CopyView* view : {&first, &second}) {
      for (torch::Tensor& tap : view->taps) {
        tap.sub_(0.05 * tap.grad().sign());
        tap.mutable_grad() = torch::Tensor();
      }
    }
  }
  EXPECT_LT(loss().item<double>(), before - 0.15);
}

}  // namespace
}  // namespace color3d
