#include "tests/bench/pretrain/network_start.h"

#include <torch/types.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/base/error.h"
#include "core/base/random.h"
#include "tests/support/networks/random_features.h"

namespace color3d {
namespace {

constexpr double kBlockScale = 0.3;  // start of gamma: residual branches begin small
constexpr double kLeastShare = 1e-6;

const WeightArray& Find(const WeightMap& weights, const std::string& name) {
  const auto found = weights.find(name);
  if (found == weights.end()) {
    throw InvalidArgument("the initial weights lack {}", name);
  }
  return found->second;
}

}  // namespace

std::unique_ptr<ConvNext> NewEncoder(const ConvNextConfig& config, uint64_t seed) {
  auto encoder = std::make_unique<ConvNext>(
      config, RandomFeatureWeights(config, seed), "ConvNeXt in pre-training");
  Random random(seed, 7);
  for (auto& [name, tensor] : encoder->Parameters()) {
    if (name.ends_with("gamma")) tensor.fill_(kBlockScale);
    if (tensor.dim() < 2 || name.starts_with("downsample_layers.0.")) continue;
    const double deviation = std::sqrt(1.0 / static_cast<double>(tensor[0].numel()));
    torch::Tensor plain = torch::empty(tensor.sizes());
    float* values = plain.data_ptr<float>();
    for (int64_t i = 0; i < plain.numel(); ++i) {
      values[i] = static_cast<float>(deviation * random.NextNormal());
    }
    torch::Tensor target = tensor;
    target.copy_(plain);
  }
  for (auto& [name, tensor] : encoder->Parameters()) {
    if (name.ends_with("bias") && !name.starts_with("downsample_layers.0.")) tensor.zero_();
  }
  return encoder;
}

std::vector<ColorHistogram::Bin> BinsOf(const WeightMap& weights, const ColorHistogram& histogram) {
  const WeightArray& array = Find(weights, "color_bins");
  if (array.shape.size() != 2 || array.shape[0] < 1 || array.shape[1] != 2) {
    throw InvalidArgument("color_bins of the initial weights is not a list of (a, b)");
  }
  const std::vector<ColorHistogram::Bin> counted = histogram.Bins(0.0);
  std::vector<ColorHistogram::Bin> bins;
  double sum = 0.0;
  for (int64_t i = 0; i < array.shape[0]; ++i) {
    ColorHistogram::Bin bin{{array.values[2 * i], array.values[2 * i + 1]}, kLeastShare};
    for (const ColorHistogram::Bin& other : counted) {
      if (other.center_ab == bin.center_ab) bin.share = std::max(bin.share, other.share);
    }
    sum += bin.share;
    bins.push_back(bin);
  }
  for (ColorHistogram::Bin& bin : bins) bin.share /= sum;
  return bins;
}

void CopyWeights(const WeightMap& weights, const NamedTensors& tensors) {
  torch::NoGradGuard no_grad;
  for (const auto& [name, tensor] : tensors) {
    if (!name.starts_with("encoder.") && !name.starts_with("color_head.")) continue;
    const WeightArray& array = Find(weights, name);
    if (array.shape != tensor.sizes().vec()) {
      throw InvalidArgument("{} of the initial weights has another shape", name);
    }
    const torch::Tensor plain = torch::empty(array.shape);
    std::memcpy(plain.data_ptr<float>(), array.values.data(), array.values.size() * sizeof(float));
    if (!torch::isfinite(plain).all().item<bool>()) {
      throw InvalidArgument("{} of the initial weights is not finite", name);
    }
    torch::Tensor target = tensor;
    target.copy_(plain);
  }
}

}  // namespace color3d
