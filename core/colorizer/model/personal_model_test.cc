#include "core/colorizer/model/personal_model.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include "tests/support/networks/small_colorizer.h"

namespace color3d {
namespace {

using PersonalModelTest = SmallColorizerTest;

TEST_F(PersonalModelTest, AdaptersStartAsIdentity) {
  recipe_.model.adapter_stages = 8;
  PersonalModel model = MakeModel();
  torch::NoGradGuard no_grad;
  const auto adapted = model.Taps(KeyTensor());
  const auto frozen = encoder_.Taps(encoder_.Input(KeyTensor()));
  for (size_t i = 0; i < frozen.size(); ++i) EXPECT_TRUE(torch::equal(adapted[i], frozen[i]));
}

TEST_F(PersonalModelTest, FreezesStatisticsOfKeyView) {
  PersonalModel model = MakeModel();
  torch::NoGradGuard no_grad;
  // The prediction of a crop does not depend on the rest of the picture, unlike with instance norm.
  // Compared away from the border of the crop.
  const torch::Tensor whole = torch::rand({1, 1, 64, 128}) * 100.0;
  torch::Tensor other = whole.clone();
  other.slice(3, 96, 128).fill_(5.0);
  const torch::Tensor x = model.Forward(whole).slice(3, 0, 20);
  const torch::Tensor y = model.Forward(other).slice(3, 0, 20);
  EXPECT_LT((x - y).abs().max().item<double>(), 1e-6);
  recipe_.model.instance_norm = true;
  PersonalModel paper = MakeModel();
  const torch::Tensor u = paper.Forward(whole).slice(3, 0, 20);
  const torch::Tensor v = paper.Forward(other).slice(3, 0, 20);
  EXPECT_GT((u - v).abs().max().item<double>(), 1e-5);
}

TEST_F(PersonalModelTest, AnswersEachPixelAtFullResolution) {
  torch::NoGradGuard no_grad;
  const torch::Tensor luminance = torch::rand({1, 1, 64, 96}) * 100.0;
  const PersonalModel coarse = MakeModel();
  EXPECT_EQ(coarse.Forward(luminance).size(3) * coarse.OutputStride(), 96);
  EXPECT_GT(coarse.OutputStride(), 1);
  recipe_.model.full_resolution = true;
  const PersonalModel fine = MakeModel();
  EXPECT_EQ(fine.OutputStride(), 1);
  EXPECT_EQ(fine.Forward(luminance).sizes(), torch::IntArrayRef({1, 2, 64, 96}));
}

}  // namespace
}  // namespace color3d
