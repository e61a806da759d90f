#include "core/keycolor/automatic/color_head.h"

#include <torch/types.h>

#include <cmath>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kFinestWidth = 96;
constexpr int kWidestWidth = 192;
constexpr double kNormEpsilon = 1e-6;

int LevelWidth(int level_from_fine) {
  return std::min(kWidestWidth, kFinestWidth + 32 * level_from_fine);
}

}  // namespace

ColorHead::ColorHead(const ConvNextConfig& encoder, int bin_count, Random& random) {
  const int taps = encoder.StageCount();
  if (taps < 3) throw InvalidArgument("the colour head needs an encoder with at least 3 taps");
  for (int tap = taps - 1; tap >= 1; --tap) {
    const int width = LevelWidth(tap - 1);
    const int finer = LevelWidth(std::max(0, tap - 2));
    const std::string name = "levels." + std::to_string(tap) + ".";
    Level level;
    level.lateral =
        NewWeight(name + "lateral.weight", {width, encoder.dims[tap], 1, 1}, 1.0, random);
    level.lateral_bias = NewWeight(name + "lateral.bias", {width}, 0.0, random);
    level.fuse = NewWeight(name + "fuse.weight", {finer, width, 3, 3}, std::sqrt(2.0), random);
    level.fuse_bias = NewWeight(name + "fuse.bias", {finer}, 0.0, random);
    levels_.push_back(level);
  }
  norm_weight_ = NewWeight("norm.weight", {kFinestWidth}, 0.0, random);
  norm_weight_.fill_(1.0f);
  norm_bias_ = NewWeight("norm.bias", {kFinestWidth}, 0.0, random);
  out_ = NewWeight("out.weight", {bin_count, kFinestWidth, 1, 1}, 0.3, random);
  out_bias_ = NewWeight("out.bias", {bin_count}, 0.0, random);
}

torch::Tensor ColorHead::NewWeight(const std::string& name,
                                   std::vector<int64_t> shape,
                                   double gain,
                                   Random& random) {
  torch::Tensor tensor = torch::zeros(shape, torch::kFloat32);
  if (gain > 0.0) {
    const double deviation = gain / std::sqrt(static_cast<double>(tensor[0].numel()));
    float* values = tensor.data_ptr<float>();
    for (int64_t i = 0; i < tensor.numel(); ++i) {
      values[i] = static_cast<float>(deviation * random.NextNormal());
    }
  }
  if (shape.size() == 4) tensor = tensor.contiguous(at::MemoryFormat::ChannelsLast);
  parameters_.emplace_back(name, tensor);
  return tensor;
}

torch::Tensor ColorHead::Forward(const std::vector<torch::Tensor>& taps) const {
  torch::Tensor x;
  for (size_t i = 0; i < levels_.size(); ++i) {
    const Level& level = levels_[i];
    torch::Tensor y = torch::conv2d(taps[taps.size() - 1 - i], level.lateral, level.lateral_bias);
    if (x.defined()) {
      y = y + torch::upsample_bilinear2d(x, {y.size(2), y.size(3)}, /*align_corners=*/false);
    }
    x = torch::gelu(torch::conv2d(y, level.fuse, level.fuse_bias, /*stride=*/1, /*padding=*/1));
  }
  const torch::Tensor normed = torch::layer_norm(x.permute({0, 2, 3, 1}).to(torch::kFloat32),
                                                 {x.size(1)},
                                                 norm_weight_,
                                                 norm_bias_,
                                                 kNormEpsilon)
                                   .permute({0, 3, 1, 2});
  return torch::conv2d(normed, out_, out_bias_);
}

}  // namespace color3d
