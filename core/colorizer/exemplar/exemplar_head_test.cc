#include "core/colorizer/exemplar/exemplar_head.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include "core/base/error.h"
#include "core/colorizer/training/adam.h"

namespace color3d {
namespace {

struct Input {
  std::vector<torch::Tensor> taps;
  torch::Tensor luminance = torch::full({1, 1, 64, 64}, 60.0);
  NeighborColors found{
      torch::full({2, 16, 16}, 12.0), torch::full({16, 16}, 1.0), torch::full({16, 16}, 9.0)};
};

std::shared_ptr<const TapEncoder> TheEncoder() {
  return std::dynamic_pointer_cast<const TapEncoder>(Encoder::Embedded());
}

// The embedded encoder under another digest.
class OtherEncoder : public TapEncoder {
 public:
  const std::string& digest() const override { return name_; }
  const std::string& description() const override { return name_; }
  std::vector<double> Describe(const Image& l) const override { return TheEncoder()->Describe(l); }
  Image DeepFeatures(const Image& l) const override { return TheEncoder()->DeepFeatures(l); }
  const ConvNextConfig& config() const override { return TheEncoder()->config(); }
  torch::Tensor Input(const torch::Tensor& l) const override { return TheEncoder()->Input(l); }
  std::vector<torch::Tensor> Taps(const torch::Tensor& input, const BlockAdapter&) const override {
    return TheEncoder()->Taps(input);
  }

 private:
  const std::string name_ = "other";
};

Input MakeInput() {
  Input input;
  input.taps = TheEncoder()->Taps(TheEncoder()->Input(input.luminance));
  return input;
}

TEST(ExemplarHeadTest, KeepsNeighborColorsUntilTrained) {
  const Input input = MakeInput();
  Random random(1);
  const ExemplarHead head(TheEncoder()->config(), random);
  const torch::Tensor ab = head.Refine(input.taps, input.luminance, input.found);
  EXPECT_LT((ab - input.found.ab).abs().max().item<double>(), 1e-4);
}

TEST(ExemplarHeadTest, LearnsConstantCorrection) {
  const Input input = MakeInput();
  Random random(1);
  const ExemplarHead head(TheEncoder()->config(), random);
  for (const auto& [name, tensor] : head.parameters()) tensor.set_requires_grad(true);
  Adam adam(head.parameters());
  for (int i = 0; i < 60; ++i) {
    (head.Refine(input.taps, input.luminance, input.found) - 20.0).square().mean().backward();
    adam.Step(0.01, 1e9);
  }
  torch::NoGradGuard no_grad;
  const torch::Tensor ab = head.Refine(input.taps, input.luminance, input.found);
  EXPECT_NEAR(ab.mean().item<double>(), 20.0, 1.0);
}

TEST(ExemplarHeadTest, RestoresWeights) {
  const Input input = MakeInput();
  Random first_random(1), second_random(2);
  const ExemplarHead first(TheEncoder()->config(), first_random);
  first.parameters().back().second.fill_(0.3);
  ExemplarHead second(TheEncoder()->config(), second_random);
  second.SetWeights(first.Weights());
  EXPECT_TRUE(torch::equal(second.Refine(input.taps, input.luminance, input.found),
                           first.Refine(input.taps, input.luminance, input.found)));
  WeightMap damaged = first.Weights();
  damaged.erase("conv2.bias");
  EXPECT_THROW(second.SetWeights(damaged), Error);
}

TEST(ExemplarHeadTest, RefusesOtherEncoder) {
  try {
    ExemplarHead::Embedded(OtherEncoder());
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailedPrecondition);
    EXPECT_NE(std::string(e.what()).find("personalize.recipe"), std::string::npos) << e.what();
  }
}

TEST(ExemplarHeadTest, EmbeddedWeightsCorrectNeighbors) {
  const Input input = MakeInput();
  const auto head = ExemplarHead::Embedded(*TheEncoder());
  const torch::Tensor ab = head->Refine(input.taps, input.luminance, input.found);
  const double change = (ab - input.found.ab).abs().mean().item<double>();
  EXPECT_GT(change, 0.01) << "the weights are untrained";
  EXPECT_LT(change, 12.0);
}

}  // namespace
}  // namespace color3d
