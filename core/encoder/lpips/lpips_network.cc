#include "core/encoder/lpips/lpips_network.h"

#include <fmt/core.h>

#include <utility>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int64_t kFirstChannels = 64;    // of both published backbones
constexpr int64_t kMaxLpipsDivisor = 16;  // divides all channel counts
constexpr int64_t kAlexNetKernel = 11;

struct LayerShape {
  int number;  // in torchvision's `features`
  int64_t channels;
  int64_t kernel = 3, stride = 1;
  bool pools_before = false;
  bool is_compared = false;
};

const std::vector<LayerShape>& AlexNetLayers() {
  static const std::vector<LayerShape> layers = {{0, 64, kAlexNetKernel, 4, false, true},
                                                 {3, 192, 5, 1, true, true},
                                                 {6, 384, 3, 1, true, true},
                                                 {8, 256, 3, 1, false, true},
                                                 {10, 256, 3, 1, false, true}};
  return layers;
}

const std::vector<LayerShape>& VggLayers() {
  static const std::vector<LayerShape> layers = {{0, 64},
                                                 {2, 64, 3, 1, false, true},
                                                 {5, 128, 3, 1, true},
                                                 {7, 128, 3, 1, false, true},
                                                 {10, 256, 3, 1, true},
                                                 {12, 256},
                                                 {14, 256, 3, 1, false, true},
                                                 {17, 512, 3, 1, true},
                                                 {19, 512},
                                                 {21, 512, 3, 1, false, true},
                                                 {24, 512, 3, 1, true},
                                                 {26, 512},
                                                 {28, 512, 3, 1, false, true}};
  return layers;
}

}  // namespace

LpipsNetwork::LpipsNetwork(WeightMap backbone, WeightMap linear) {
  TakeBackbone(std::move(backbone));
  TakeLinear(std::move(linear));
}

void LpipsNetwork::TakeBackbone(WeightMap weights) {
  WeightReader reader(std::move(weights), "the weights of the backbone of LPIPS");
  const std::string first = "features.0.weight";
  const int64_t channels = StoredSize(reader, first, 0);
  if (channels < 1 || kFirstChannels % channels != 0 ||
      kFirstChannels / channels > kMaxLpipsDivisor) {
    throw InvalidArgument(
        "the weights of the backbone of LPIPS do not fit the network: {} {}; expected those of "
        "torchvision's alexnet or vgg16, with {} channels",
        first,
        channels == 0 ? std::string("is missing") : fmt::format("has {} channels", channels),
        kFirstChannels);
  }
  divisor_ = kFirstChannels / channels;
  is_alexnet_ = StoredSize(reader, first, 2) == kAlexNetKernel;
  reader.IgnorePrefix("classifier.");
  int64_t in = 3;
  for (const LayerShape& shape : is_alexnet_ ? AlexNetLayers() : VggLayers()) {
    const int64_t out = shape.channels / divisor_;
    const std::string name = fmt::format("features.{}.", shape.number);
    // AlexNet pads its first layer of 11 px by 2, all other layers keep the size.
    const int64_t padding = shape.kernel == kAlexNetKernel ? 2 : shape.kernel / 2;
    layers_.push_back({TakeLayer(reader, name, {out, in, shape.kernel, shape.kernel}),
                       shape.stride,
                       padding,
                       shape.pools_before,
                       shape.is_compared});
    in = out;
  }
  reader.Finish();
}

void LpipsNetwork::TakeLinear(WeightMap weights) {
  WeightReader reader(
      std::move(weights),
      fmt::format("the linear layers of LPIPS for {}", is_alexnet_ ? "AlexNet" : "VGG 16"));
  for (const Convolution& layer : layers_) {
    if (!layer.is_compared) continue;
    channel_weights_.push_back(
        TakeTensor(reader,
                   fmt::format("lin{}.model.1.weight", channel_weights_.size()),
                   {1, layer.layer.weight.size(0), 1, 1}));
  }
  reader.Finish();
}

std::string LpipsNetwork::ToString() const {
  return fmt::format("LPIPS with {}{}",
                     is_alexnet_ ? "AlexNet" : "VGG 16",
                     divisor_ == 1 ? "" : fmt::format(" of 1/{} of the channels", divisor_));
}

std::vector<torch::Tensor> LpipsNetwork::Features(const torch::Tensor& rgb) const {
  constexpr double kLeastLength = 1e-10;
  const torch::Tensor shift = torch::tensor({-0.030f, -0.088f, -0.188f}).view({1, 3, 1, 1});
  const torch::Tensor scale = torch::tensor({0.458f, 0.448f, 0.450f}).view({1, 3, 1, 1});
  torch::Tensor x = ((2.0 * rgb - 1.0) - shift) / scale;
  std::vector<torch::Tensor> features;
  const int64_t pool = is_alexnet_ ? 3 : 2;
  for (const Convolution& step : layers_) {
    if (step.pools_before) x = torch::max_pool2d(x, {pool, pool}, {2, 2});
    x = torch::relu(torch::conv2d(x,
                                  step.layer.weight,
                                  step.layer.bias,
                                  /*stride=*/{step.stride, step.stride},
                                  /*padding=*/{step.padding, step.padding}));
    if (!step.is_compared) continue;
    const torch::Tensor length = torch::sqrt((x * x).sum(at::IntArrayRef{1}, /*keepdim=*/true));
    features.push_back(x / (length + kLeastLength));
  }
  return features;
}

double LpipsNetwork::Distance(const torch::Tensor& rgb, const torch::Tensor& other_rgb) const {
  const std::vector<torch::Tensor> one = Features(rgb), other = Features(other_rgb);
  double distance = 0.0;
  for (size_t i = 0; i < one.size(); ++i) {
    const torch::Tensor difference = one[i] - other[i];
    distance += torch::conv2d(difference * difference, channel_weights_[i]).mean().item<double>();
  }
  return distance;
}

}  // namespace color3d
