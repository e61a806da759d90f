#include "core/colorizer/model/padding.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include <vector>

namespace color3d {
namespace {

TEST(PaddingTest, ReflectsOrReplicatesToMultiples) {
  const torch::Tensor x = torch::arange(12, torch::kFloat32).view({1, 1, 3, 4});
  const torch::Tensor padded = PadToMultiple(x, 5);
  EXPECT_EQ(padded.sizes(), (std::vector<int64_t>{1, 1, 5, 5}));
  EXPECT_EQ(padded[0][0][0][4].item<float>(), 2.0f);
  EXPECT_EQ(padded[0][0][3][0].item<float>(), 4.0f);
  EXPECT_TRUE(torch::equal(PadToMultiple(x, 1), x));
  EXPECT_EQ(PadToMultiple(torch::ones({1, 1, 1, 1}), 32).sum().item<float>(), 1024.0f);
}

}  // namespace
}  // namespace color3d
