#include "core/colorizer/model/named_tensors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <torch/types.h>

#include <limits>
#include <string>

#include "core/base/error.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

TEST(NamedTensorsTest, NamesTensorsThatDoNotFit) {
  TensorFile file;
  PutTensors({{"x", torch::ones({2, 3})}}, "net.", StoredType::kFloat16, &file);
  EXPECT_TRUE(file.half.contains("net.x"));
  const auto message_of = [&](const NamedTensors& tensors) -> std::string {
    TensorFile copy = file;
    try {
      TakeTensors(tensors, "net.", "the test file", &copy);
    } catch (const Error& error) {
      EXPECT_EQ(copy.arrays.size(), 1u);
      return error.what();
    }
    EXPECT_TRUE(copy.arrays.empty());
    return "";
  };
  EXPECT_THAT(message_of({{"y", torch::ones({2, 3})}}), HasSubstr("has no array \"net.y\""));
  EXPECT_THAT(message_of({{"x", torch::ones({3, 2})}}), HasSubstr("another shape"));
  torch::Tensor target = torch::zeros({2, 3});
  EXPECT_EQ(message_of({{"x", target}}), "");
  EXPECT_EQ(target.sum().item<float>(), 6.0f);
  file.arrays.at("net.x").values[4] = std::numeric_limits<float>::infinity();
  EXPECT_THAT(message_of({{"x", target}}), HasSubstr("not finite in \"net.x\""));
}

}  // namespace
}  // namespace color3d
