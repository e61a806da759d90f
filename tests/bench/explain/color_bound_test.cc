#include "tests/bench/explain/color_bound.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include <cmath>

#include "core/base/error.h"
#include "tests/support/networks/small_colorizer.h"

namespace color3d {
namespace {

class ColorBoundTest : public SmallColorizerTest {
 protected:
  // Patches of the key view's texture around points on a row.
  torch::Tensor Patches(int count, int shift) const {
    const torch::Tensor key = TensorFromImage(pictures_[0].luminance) / 100.0;
    std::vector<torch::Tensor> patches;
    for (int i = 0; i < count; ++i) {
      patches.push_back(key.narrow(2, 8, 32).narrow(3, 5 * i + shift, 32));
    }
    return torch::cat(patches).contiguous();
  }
};

TEST_F(ColorBoundTest, PartsTogetherAreTheModel) {
  const PersonalModel model = MakeModel();
  const PatchColorizer colorizer(model, encoder_, 32);
  torch::NoGradGuard no_grad;
  const torch::Tensor patches = Patches(3, 0);
  const torch::Tensor ab = colorizer.Decode(colorizer.Encode(patches));
  const torch::Tensor whole = model.Forward(patches * 100.0) * kAbScale;
  const torch::Tensor middle = whole.slice(2, 7, 9).slice(3, 7, 9).mean({2, 3});
  EXPECT_LT((ab - middle).abs().max().item<double>(), 1e-3);
}

TEST_F(ColorBoundTest, EncoderDerivativeMatchesDifferences) {
  const PersonalModel model = MakeModel();
  const PatchColorizer colorizer(model, encoder_, 32);
  const torch::Tensor patch = Patches(1, 3);
  const torch::Tensor at = patch.clone().set_requires_grad(true);
  const torch::Tensor direction = torch::ones_like(patch) * 0.0002;
  colorizer.Decode(colorizer.Encode(at)).narrow(1, 0, 1).sum().backward();
  const double predicted = (at.grad() * direction).sum().item<double>();
  torch::NoGradGuard no_grad;
  const auto answer = [&](const torch::Tensor& x) {
    return colorizer.Decode(colorizer.Encode(x)).narrow(1, 0, 1).sum().item<double>();
  };
  const double measured = 0.5 * (answer(patch + direction) - answer(patch - direction));
  EXPECT_NEAR(predicted, measured, 0.05 * std::abs(measured));
}

TEST_F(ColorBoundTest, ChainRuleBoundsWholeNorm) {
  const PersonalModel model = MakeModel();
  const PatchColorizer colorizer(model, encoder_, 32);
  const JacobianNorms norms = MeasureNorms(colorizer, Patches(1, 0), 12);
  EXPECT_GT(norms.whole, 0.0);
  EXPECT_LE(norms.whole, 1.05 * norms.encoder * norms.decoder);
}

TEST_F(ColorBoundTest, EqualPatchesHaveNoDistance) {
  const PersonalModel model = MakeModel();
  const PatchColorizer colorizer(model, encoder_, 32);
  const torch::Tensor first = Patches(4, 0), second = Patches(4, 2);
  const auto points = MeasurePoints(colorizer, {first, second, first});
  ASSERT_EQ(points.size(), 4u);
  for (const PointDistances& point : points) {
    EXPECT_NEAR(point.equivariance, 0.0, 1e-4);
    EXPECT_GT(point.image, 0.0);
    EXPECT_NEAR(point.rest_image, point.image, 1e-6);
    EXPECT_NEAR(point.rest_feature, point.feature, 1e-4 * point.feature);
  }
}

TEST_F(ColorBoundTest, RefusesPatchesThatDoNotFitStrides) {
  const PersonalModel model = MakeModel();
  EXPECT_THROW(PatchColorizer(model, encoder_, 30), Error);
}

TEST(CompareWithBoundTest, FollowsProposition) {
  // L_phi 2, L_psi 3. The second point's colours differ more than the bound allows.
  const std::vector<PointDistances> points = {{.image = 1.0,
                                               .feature = 1.5,
                                               .color = 4.0,
                                               .equivariance = 0.5,
                                               .rest_image = 0.5,
                                               .rest_feature = 1.2},
                                              {.image = 0.1,
                                               .feature = 0.1,
                                               .color = 9.0,
                                               .equivariance = 0.2,
                                               .rest_image = 0.1,
                                               .rest_feature = 0.1}};
  const ColorBound bound = CompareWithBound(points, {.encoder = 2.0, .decoder = 3.0});
  EXPECT_EQ(bound.points, 2);
  EXPECT_NEAR(bound.color, 6.5, 1e-12);
  EXPECT_NEAR(bound.largest_color, 9.0, 1e-12);
  EXPECT_NEAR(bound.encoder_ratio, 1.5, 1e-12);
  EXPECT_NEAR(bound.decoder_ratio, 90.0, 1e-9);
  EXPECT_NEAR(bound.equivariance, 0.5, 1e-12);
  EXPECT_NEAR(bound.residual, 0.2, 1e-12);
  // 3 (2 * 1 + 0.2 + 0.5) = 8.1 and 3 (2 * 0.1 + 0.2 + 0.5) = 2.7.
  EXPECT_NEAR(bound.bound, 5.4, 1e-12);
  EXPECT_NEAR(bound.holds, 0.5, 1e-12);
}

}  // namespace
}  // namespace color3d
