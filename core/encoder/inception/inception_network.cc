#include "core/encoder/inception/inception_network.h"

#include <fmt/core.h>

#include <utility>

#include "core/base/error.h"
#include "core/encoder/weight_tensors.h"

namespace color3d {
namespace {

constexpr int64_t kSidePx = 299;
constexpr int64_t kStemChannels = 32;         // of the published first layer
constexpr int64_t kMaxInceptionDivisor = 16;  // divides all channel counts
constexpr int64_t kFidClasses = 1008;         // of the network of the original FID
constexpr double kNormEpsilon = 1e-3;

torch::Tensor MaxPool(const torch::Tensor& x, int64_t stride, int64_t padding) {
  return torch::max_pool2d(x, {3, 3}, {stride, stride}, {padding, padding});
}

int64_t DivisorOf(const WeightReader& reader) {
  const std::string first = "Conv2d_1a_3x3.conv.weight";
  const int64_t channels = StoredSize(reader, first, 0);
  if (channels < 1 || kStemChannels % channels != 0 ||
      kStemChannels / channels > kMaxInceptionDivisor) {
    throw InvalidArgument(
        "the Inception weights do not fit the network: {} {}; expected the names of torchvision's "
        "inception_v3 or of pytorch-fid, with {} channels",
        first,
        channels == 0 ? std::string("is missing") : fmt::format("has {} channels", channels),
        kStemChannels);
  }
  return kStemChannels / channels;
}

}  // namespace

torch::Tensor InceptionNetwork::Convolution::operator()(const torch::Tensor& x) const {
  return torch::relu(torch::conv2d(
      x, weight, bias, /*stride=*/{stride, stride}, /*padding=*/{padding[0], padding[1]}));
}

InceptionNetwork::InceptionNetwork(WeightMap weights) {
  WeightReader reader(std::move(weights), "the Inception weights");
  divisor_ = DivisorOf(reader);
  of_fid_ = StoredSize(reader, "fc.weight", 0) == kFidClasses;
  reader.IgnorePrefix("fc.");
  reader.IgnorePrefix("AuxLogits.");
  reader.Ignore("num_batches_tracked");
  TakeStem(reader);
  TakeBlockA(reader, "Mixed_5b.", 192, 32);
  TakeBlockA(reader, "Mixed_5c.", 256, 64);
  TakeBlockA(reader, "Mixed_5d.", 288, 64);
  TakeBlockB(reader, "Mixed_6a.");
  TakeBlockC(reader, "Mixed_6b.", 128);
  TakeBlockC(reader, "Mixed_6c.", 160);
  TakeBlockC(reader, "Mixed_6d.", 160);
  TakeBlockC(reader, "Mixed_6e.", 192);
  TakeBlockD(reader, "Mixed_7a.");
  TakeBlockE(reader, "Mixed_7b.", 1280);
  TakeBlockE(reader, "Mixed_7c.", 2048);
  reader.Finish();
}

std::string InceptionNetwork::ToString() const {
  return fmt::format("Inception v3 of {} features, pooling of {}",
                     feature_count(),
                     of_fid_ ? "the original FID" : "torchvision");
}

void InceptionNetwork::Take(WeightReader& reader, const std::string& name, const Shape& shape) {
  const int64_t in = shape.in == 3 ? 3 : Channels(shape.in), out = Channels(shape.out);
  const torch::Tensor weight =
      TakeTensor(reader, name + ".conv.weight", {out, in, shape.height, shape.width});
  const torch::Tensor gain = TakeTensor(reader, name + ".bn.weight", {out});
  const torch::Tensor offset = TakeTensor(reader, name + ".bn.bias", {out});
  const torch::Tensor mean = TakeTensor(reader, name + ".bn.running_mean", {out});
  const torch::Tensor variance = TakeTensor(reader, name + ".bn.running_var", {out});
  const torch::Tensor scale = gain / torch::sqrt(variance + kNormEpsilon);
  Convolution layer;
  layer.weight = (weight * scale.view({-1, 1, 1, 1})).contiguous(at::MemoryFormat::ChannelsLast);
  layer.bias = offset - mean * scale;
  layer.stride = shape.stride;
  if (!shape.valid) layer.padding = {shape.height / 2, shape.width / 2};
  layers_[name] = std::move(layer);
}

void InceptionNetwork::TakeStem(WeightReader& reader) {
  Take(reader, "Conv2d_1a_3x3", {3, 32, 3, 3, 2, true});
  Take(reader, "Conv2d_2a_3x3", {32, 32, 3, 3, 1, true});
  Take(reader, "Conv2d_2b_3x3", {32, 64, 3, 3});
  Take(reader, "Conv2d_3b_1x1", {64, 80, 1, 1});
  Take(reader, "Conv2d_4a_3x3", {80, 192, 3, 3, 1, true});
}

void InceptionNetwork::TakeBlockA(WeightReader& reader,
                                  const std::string& block,
                                  int64_t in,
                                  int64_t pooled) {
  Take(reader, block + "branch1x1", {in, 64, 1, 1});
  Take(reader, block + "branch5x5_1", {in, 48, 1, 1});
  Take(reader, block + "branch5x5_2", {48, 64, 5, 5});
  Take(reader, block + "branch3x3dbl_1", {in, 64, 1, 1});
  Take(reader, block + "branch3x3dbl_2", {64, 96, 3, 3});
  Take(reader, block + "branch3x3dbl_3", {96, 96, 3, 3});
  Take(reader, block + "branch_pool", {in, pooled, 1, 1});
}

void InceptionNetwork::TakeBlockB(WeightReader& reader, const std::string& block) {
  Take(reader, block + "branch3x3", {288, 384, 3, 3, 2, true});
  Take(reader, block + "branch3x3dbl_1", {288, 64, 1, 1});
  Take(reader, block + "branch3x3dbl_2", {64, 96, 3, 3});
  Take(reader, block + "branch3x3dbl_3", {96, 96, 3, 3, 2, true});
}

void InceptionNetwork::TakeBlockC(WeightReader& reader, const std::string& block, int64_t inner) {
  Take(reader, block + "branch1x1", {768, 192, 1, 1});
  Take(reader, block + "branch7x7_1", {768, inner, 1, 1});
  Take(reader, block + "branch7x7_2", {inner, inner, 1, 7});
  Take(reader, block + "branch7x7_3", {inner, 192, 7, 1});
  Take(reader, block + "branch7x7dbl_1", {768, inner, 1, 1});
  Take(reader, block + "branch7x7dbl_2", {inner, inner, 7, 1});
  Take(reader, block + "branch7x7dbl_3", {inner, inner, 1, 7});
  Take(reader, block + "branch7x7dbl_4", {inner, inner, 7, 1});
  Take(reader, block + "branch7x7dbl_5", {inner, 192, 1, 7});
  Take(reader, block + "branch_pool", {768, 192, 1, 1});
}

void InceptionNetwork::TakeBlockD(WeightReader& reader, const std::string& block) {
  Take(reader, block + "branch3x3_1", {768, 192, 1, 1});
  Take(reader, block + "branch3x3_2", {192, 320, 3, 3, 2, true});
  Take(reader, block + "branch7x7x3_1", {768, 192, 1, 1});
  Take(reader, block + "branch7x7x3_2", {192, 192, 1, 7});
  Take(reader, block + "branch7x7x3_3", {192, 192, 7, 1});
  Take(reader, block + "branch7x7x3_4", {192, 192, 3, 3, 2, true});
}

void InceptionNetwork::TakeBlockE(WeightReader& reader, const std::string& block, int64_t in) {
  Take(reader, block + "branch1x1", {in, 320, 1, 1});
  Take(reader, block + "branch3x3_1", {in, 384, 1, 1});
  Take(reader, block + "branch3x3_2a", {384, 384, 1, 3});
  Take(reader, block + "branch3x3_2b", {384, 384, 3, 1});
  Take(reader, block + "branch3x3dbl_1", {in, 448, 1, 1});
  Take(reader, block + "branch3x3dbl_2", {448, 384, 3, 3});
  Take(reader, block + "branch3x3dbl_3a", {384, 384, 1, 3});
  Take(reader, block + "branch3x3dbl_3b", {384, 384, 3, 1});
  Take(reader, block + "branch_pool", {in, 192, 1, 1});
}

torch::Tensor InceptionNetwork::Run(const std::string& block,
                                    torch::Tensor x,
                                    std::initializer_list<const char*> layers) const {
  for (const char* layer : layers) x = layers_.at(block + layer)(x);
  return x;
}

// Over 3 x 3 pixels. The network of the original FID averages only those within the picture.
torch::Tensor InceptionNetwork::MeanPool(const torch::Tensor& x) const {
  return torch::avg_pool2d(
      x, {3, 3}, {1, 1}, {1, 1}, /*ceil_mode=*/false, /*count_include_pad=*/!of_fid_);
}

torch::Tensor InceptionNetwork::RunStem(torch::Tensor x) const {
  x = Run("", x, {"Conv2d_1a_3x3", "Conv2d_2a_3x3", "Conv2d_2b_3x3"});
  x = Run("", MaxPool(x, /*stride=*/2, /*padding=*/0), {"Conv2d_3b_1x1", "Conv2d_4a_3x3"});
  return MaxPool(x, /*stride=*/2, /*padding=*/0);
}

torch::Tensor InceptionNetwork::RunBlockA(const std::string& block, const torch::Tensor& x) const {
  return torch::cat({Run(block, x, {"branch1x1"}),
                     Run(block, x, {"branch5x5_1", "branch5x5_2"}),
                     Run(block, x, {"branch3x3dbl_1", "branch3x3dbl_2", "branch3x3dbl_3"}),
                     Run(block, MeanPool(x), {"branch_pool"})},
                    1);
}

torch::Tensor InceptionNetwork::RunBlockB(const std::string& block, const torch::Tensor& x) const {
  return torch::cat({Run(block, x, {"branch3x3"}),
                     Run(block, x, {"branch3x3dbl_1", "branch3x3dbl_2", "branch3x3dbl_3"}),
                     MaxPool(x, /*stride=*/2, /*padding=*/0)},
                    1);
}

torch::Tensor InceptionNetwork::RunBlockC(const std::string& block, const torch::Tensor& x) const {
  return torch::cat({Run(block, x, {"branch1x1"}),
                     Run(block, x, {"branch7x7_1", "branch7x7_2", "branch7x7_3"}),
                     Run(block,
                         x,
                         {"branch7x7dbl_1",
                          "branch7x7dbl_2",
                          "branch7x7dbl_3",
                          "branch7x7dbl_4",
                          "branch7x7dbl_5"}),
                     Run(block, MeanPool(x), {"branch_pool"})},
                    1);
}

torch::Tensor InceptionNetwork::RunBlockD(const std::string& block, const torch::Tensor& x) const {
  return torch::cat(
      {Run(block, x, {"branch3x3_1", "branch3x3_2"}),
       Run(block, x, {"branch7x7x3_1", "branch7x7x3_2", "branch7x7x3_3", "branch7x7x3_4"}),
       MaxPool(x, /*stride=*/2, /*padding=*/0)},
      1);
}

torch::Tensor InceptionNetwork::RunBlockE(const std::string& block,
                                          const torch::Tensor& x,
                                          bool max_pool) const {
  const torch::Tensor middle = Run(block, x, {"branch3x3_1"});
  const torch::Tensor wide = Run(block, x, {"branch3x3dbl_1", "branch3x3dbl_2"});
  const torch::Tensor pooled = max_pool ? MaxPool(x, /*stride=*/1, /*padding=*/1) : MeanPool(x);
  return torch::cat({Run(block, x, {"branch1x1"}),
                     Run(block, middle, {"branch3x3_2a"}),
                     Run(block, middle, {"branch3x3_2b"}),
                     Run(block, wide, {"branch3x3dbl_3a"}),
                     Run(block, wide, {"branch3x3dbl_3b"}),
                     Run(block, pooled, {"branch_pool"})},
                    1);
}

torch::Tensor InceptionNetwork::Features(const torch::Tensor& rgb) const {
  torch::Tensor x = rgb;
  if (rgb.size(2) != kSidePx || rgb.size(3) != kSidePx) {
    x = torch::upsample_bilinear2d(rgb, {kSidePx, kSidePx}, /*align_corners=*/false);
  }
  x = RunStem((2.0 * x - 1.0).contiguous(at::MemoryFormat::ChannelsLast));
  for (const char* block : {"Mixed_5b.", "Mixed_5c.", "Mixed_5d."}) x = RunBlockA(block, x);
  x = RunBlockB("Mixed_6a.", x);
  for (const char* block : {"Mixed_6b.", "Mixed_6c.", "Mixed_6d.", "Mixed_6e."}) {
    x = RunBlockC(block, x);
  }
  x = RunBlockD("Mixed_7a.", x);
  x = RunBlockE("Mixed_7b.", x, /*max_pool=*/false);
  x = RunBlockE("Mixed_7c.", x, /*max_pool=*/of_fid_);
  return x.mean(at::IntArrayRef{2, 3});
}

}  // namespace color3d
