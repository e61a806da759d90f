// The reader of TorchScript archives against the writer of LibTorch itself.
#include <gtest/gtest.h>
#include <torch/script.h>

#include <string>
#include <vector>

#include "core/base/files.h"
#include "core/weights/weight_file.h"

namespace color3d {
namespace {

torch::jit::Module MakeLayer(const std::string& name, torch::ScalarType type) {
  torch::jit::Module layer(name);
  layer.register_parameter("weight", torch::randn({3, 4, 2, 2}).to(type), false);
  // A view with its own strides, and one that shares its storage.
  const torch::Tensor table = torch::randn({5, 7}).to(type);
  layer.register_parameter("transposed", table.t(), false);
  layer.register_buffer("row", table[2]);
  layer.register_buffer("count", torch::full({}, 77, torch::kInt64));
  layer.register_attribute("scale", c10::FloatType::get(), 0.5);
  layer.register_attribute(
      "sizes", c10::ListType::ofInts(), c10::List<int64_t>({int64_t{1}, int64_t{2}}));
  return layer;
}

TEST(ScriptWeightsTest, ReadsParametersAndBuffersByPath) {
  for (const torch::ScalarType type : {torch::kFloat32, torch::kHalf, torch::kBFloat16}) {
    torch::manual_seed(3);
    torch::jit::Module inner = MakeLayer("Inner", type);
    torch::jit::Module model("Model");
    model.register_parameter("positional_embedding", torch::randn({6, 2}).to(type), false);
    model.register_attribute("none", c10::NoneType::get(), c10::IValue());
    torch::jit::Module blocks("Blocks");
    blocks.register_module("0", MakeLayer("Block0", type));
    blocks.register_module("1", inner);
    model.register_module("visual", blocks);
    model.define("def forward(self, x):\n  return x + self.positional_embedding.sum() + 3\n");
    const ScratchFolder folder;
    const std::filesystem::path path = folder.path() / "model.pt";
    model.save(path.string());
    const WeightMap weights = ReadWeightFile(path);
    size_t expected = 0;
    const auto compare = [&](const std::string& name, const torch::Tensor& tensor) {
      ++expected;
      ASSERT_EQ(weights.count(name), 1u) << name;
      const torch::Tensor plain = tensor.to(torch::kFloat32).contiguous();
      EXPECT_EQ(weights.at(name).shape, plain.sizes().vec()) << name;
      const std::vector<float> values(plain.data_ptr<float>(),
                                      plain.data_ptr<float>() + plain.numel());
      EXPECT_EQ(weights.at(name).values, values) << name;
    };
    for (const auto& item : model.named_parameters()) compare(item.name, item.value);
    for (const auto& item : model.named_buffers()) compare(item.name, item.value);
    EXPECT_EQ(weights.size(), expected);
    EXPECT_EQ(expected, 9u);
  }
}

}  // namespace
}  // namespace color3d
