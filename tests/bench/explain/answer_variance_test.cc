#include "tests/bench/explain/answer_variance.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include "core/encoder/torch_threads.h"

namespace color3d {
namespace {

class AnswerVarianceTest : public testing::Test {
 protected:
  AnswerVarianceTest() {
    SetTorchThreads(1);
    // A smooth picture: mapping there and back changes little.
    auto at = picture_.accessor<float, 4>();
    for (int64_t y = 0; y < 64; ++y) {
      for (int64_t x = 0; x < 96; ++x) at[0][0][y][x] = 30.0f + 0.3f * x + 0.2f * y;
    }
  }
  // ab at half the size.
  static torch::Tensor Half(const torch::Tensor& luminance) {
    return torch::avg_pool2d(luminance, {2, 2});
  }
  torch::Tensor picture_ = torch::empty({1, 1, 64, 96});
};

TEST_F(AnswerVarianceTest, IsZeroForConstantAnswer) {
  const AnswerSpread spread = MeasureSpread(
      [](const torch::Tensor& l) {
        const torch::Tensor half = Half(l);
        return torch::cat({torch::full_like(half, 30.0), torch::full_like(half, -40.0)}, 1);
      },
      picture_,
      12,
      1);
  EXPECT_NEAR(spread.variance, 0.0, 1e-6);
  EXPECT_NEAR(spread.chroma, 50.0, 1e-3);
  EXPECT_GT(spread.places, 0.7);
}

TEST_F(AnswerVarianceTest, MapsAnswersBack) {
  // An answer that depends on the picture. It varies where light moves its border.
  const auto follow = [](const torch::Tensor& l) {
    const torch::Tensor half = Half(l);
    return torch::cat({10.0 * (half > 50.0).to(torch::kFloat32), torch::zeros_like(half)}, 1);
  };
  const AnswerSpread following = MeasureSpread(follow, picture_, 24, 1);
  // One that depends on the frame alone.
  const auto fixed = [](const torch::Tensor& l) {
    torch::Tensor half = torch::zeros_like(Half(l));
    half.narrow(3, 0, half.size(3) / 2).fill_(10.0);
    return torch::cat({half, torch::zeros_like(half)}, 1);
  };
  const AnswerSpread fixed_spread = MeasureSpread(fixed, picture_, 24, 1);
  EXPECT_GT(fixed_spread.variance, 10.0);
  EXPECT_LT(following.variance, 0.5 * fixed_spread.variance);
}

TEST_F(AnswerVarianceTest, IsVarianceOfIndependentAnswers) {
  // The answers alternate between -3 and 3 in a: variance 9 (n / (n - 1) for n draws).
  int calls = 0;
  const AnswerSpread spread = MeasureSpread(
      [&calls](const torch::Tensor& l) {
        const torch::Tensor half = Half(l);
        const double a = ++calls % 2 == 0 ? 3.0 : -3.0;
        return torch::cat({torch::full_like(half, a), torch::zeros_like(half)}, 1);
      },
      picture_,
      40,
      1);
  EXPECT_NEAR(spread.variance, 9.0 * 40.0 / 39.0, 0.5);
}

TEST_F(AnswerVarianceTest, IsRepeatable) {
  const auto answer = [](const torch::Tensor& l) {
    const torch::Tensor half = Half(l);
    return torch::cat({half, -half}, 1);
  };
  EXPECT_EQ(MeasureSpread(answer, picture_, 8, 3).variance,
            MeasureSpread(answer, picture_, 8, 3).variance);
  EXPECT_NE(MeasureSpread(answer, picture_, 8, 3).variance,
            MeasureSpread(answer, picture_, 8, 4).variance);
}

}  // namespace
}  // namespace color3d
