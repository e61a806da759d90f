#include "core/colorizer/model/personal_model.h"

#include <torch/types.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kBlocksPerLevel = 2;
constexpr double kLeak = 0.2;
constexpr double kNormEpsilon = 1e-5;
constexpr double kMeanSquareShare = 0.01;
constexpr double kFlatChange = 0.03;  // variance over mean square; natural pictures have 0.3 to 1

torch::Tensor LeakyRelu(const torch::Tensor& x) { return torch::leaky_relu(x, kLeak); }

// Standard deviation of He's initialization for a leaky rectifier.
double HeDeviation(int64_t fan_in) {
  return std::sqrt(2.0 / ((1.0 + kLeak * kLeak) * static_cast<double>(fan_in)));
}

torch::Tensor UpsampleTwice(const torch::Tensor& x) {
  return torch::upsample_bilinear2d(x, {2 * x.size(2), 2 * x.size(3)}, /*align_corners=*/false);
}

}  // namespace

int DecoderWidth(int stride) {
  if (stride <= 2) return 32;
  if (stride <= 4) return 64;
  return stride <= 8 ? 96 : 128;
}

PersonalModel::PersonalModel(const TapEncoder& encoder,
                             const PersonalModelConfig& config,
                             const std::array<float, 2>& mean_ab,
                             Random& random)
    : encoder_(encoder), config_(config) {
  const std::vector<int>& dims = encoder.config().dims;
  const int count = static_cast<int>(dims.size());
  const auto width = [&](int level) {
    constexpr double kMultiple = 8.0;  // width of vector units
    const double channels = config.decoder_width * DecoderWidth(encoder.config().Stride(level));
    return static_cast<int>(kMultiple * std::max(1.0, std::round(channels / kMultiple)));
  };
  for (int i = 0; i < count; ++i) {
    // The finest level also sees L itself; all but the coarsest see the level below.
    const int64_t in = dims[i] + (i == 0 ? 1 : 0) + (i + 1 < count ? width(i + 1) : 0);
    AddLevel("decoder." + std::to_string(i) + ".", in, width(i), random);
  }
  // A small head: the first predictions stay near the mean colour of the key view.
  const int stride = encoder.config().stem_stride;
  const int64_t pixels = config.full_resolution ? stride * stride : 1;  // outputs per channel
  head_ = NewParameter(
      "head.weight", {2 * pixels, width(0), 3, 3}, 0.1 * HeDeviation(9 * width(0)), random);
  head_bias_ = NewConstant("head.bias", {2 * pixels}, 0.0f);
  for (int64_t i = 0; i < 2 * pixels; ++i) head_bias_[i] = mean_ab[i / pixels];
  if (config.HasAdapters()) AddAdapters(random);
}

torch::Tensor PersonalModel::NewParameter(const std::string& name,
                                          std::vector<int64_t> shape,
                                          double deviation,
                                          Random& random) {
  torch::Tensor tensor = torch::empty(shape, torch::kFloat32);
  float* values = tensor.data_ptr<float>();
  for (int64_t i = 0; i < tensor.numel(); ++i) {
    values[i] = static_cast<float>(deviation * random.NextNormal());
  }
  if (shape.size() == 4) tensor = tensor.contiguous(at::MemoryFormat::ChannelsLast);
  parameters_.emplace_back(name, tensor);
  return tensor;
}

torch::Tensor PersonalModel::NewConstant(const std::string& name,
                                         std::vector<int64_t> shape,
                                         float value) {
  torch::Tensor tensor = torch::full(shape, value, torch::kFloat32);
  parameters_.emplace_back(name, tensor);
  return tensor;
}

PersonalModel::Norm PersonalModel::NewNorm(const std::string& name, int64_t channels) {
  Norm norm;
  norm.weight = NewConstant(name + "weight", {channels}, 1.0f);
  norm.bias = NewConstant(name + "bias", {channels}, 0.0f);
  if (!config_.instance_norm) {
    norm.mean = torch::zeros({channels});
    norm.inverse_deviation = torch::ones({channels});
    statistics_.emplace_back(name + "mean", norm.mean);
    statistics_.emplace_back(name + "inverse_deviation", norm.inverse_deviation);
  }
  return norm;
}

void PersonalModel::AddLevel(const std::string& name, int64_t in, int64_t out, Random& random) {
  Level level;
  level.fuse = NewParameter(name + "fuse.weight", {out, in, 1, 1}, HeDeviation(in), random);
  level.fuse_bias = NewConstant(name + "fuse.bias", {out}, 0.0f);
  level.norm = NewNorm(name + "norm.", out);
  for (int i = 0; i < kBlocksPerLevel; ++i) {
    const std::string block_name = name + "blocks." + std::to_string(i) + ".";
    ResidualBlock block;
    block.conv1 =
        NewParameter(block_name + "conv1.weight", {out, out, 3, 3}, HeDeviation(9 * out), random);
    block.bias1 = NewConstant(block_name + "conv1.bias", {out}, 0.0f);
    block.norm = NewNorm(block_name + "norm.", out);
    block.conv2 = NewParameter(
        block_name + "conv2.weight", {out, out, 3, 3}, 0.5 * HeDeviation(9 * out), random);
    block.bias2 = NewConstant(block_name + "conv2.bias", {out}, 0.0f);
    level.blocks.push_back(block);
  }
  levels_.push_back(level);
}

void PersonalModel::AddAdapters(Random& random) {
  const ConvNextConfig& encoder = encoder_.config();
  adapters_.resize(encoder.StageCount());
  const int first_stage = std::max(0, encoder.StageCount() - config_.adapter_stages);
  for (int stage = first_stage; stage < encoder.StageCount(); ++stage) {
    const int64_t c = encoder.dims[stage];
    const int64_t reduced = c / config_.adapter_reduction;
    const int64_t k = config_.adapter_kernel;
    for (int i = 0; i < encoder.depths[stage]; ++i) {
      const std::string name = "adapters." + std::to_string(stage) + "." + std::to_string(i) + ".";
      const int64_t fan_in = k * k * config_.adapter_reduction;
      Adapter adapter;
      adapter.grouped = NewParameter(name + "conv1.weight",
                                     {reduced, config_.adapter_reduction, k, k},
                                     std::sqrt(2.0 / static_cast<double>(fan_in)),
                                     random);
      adapter.grouped_bias = NewConstant(name + "conv1.bias", {reduced}, 0.0f);
      // Zero: iteration 0 equals the frozen encoder exactly.
      adapter.pointwise = NewConstant(name + "conv2.weight", {c, reduced, 1, 1}, 0.0f);
      adapter.pointwise_bias = NewConstant(name + "conv2.bias", {c}, 0.0f);
      adapter.scale = NewConstant(name + "scale", {1, c, 1, 1}, 1.0f);
      adapters_[stage].push_back(adapter);
    }
  }
}

torch::Tensor PersonalModel::Normalize(const Norm& norm, const torch::Tensor& x) const {
  const int64_t c = x.size(1);
  if (config_.instance_norm) {
    return torch::instance_norm(
        x, norm.weight, norm.bias, {}, {}, /*use_input_stats=*/true, 0.0, kNormEpsilon, false);
  }
  if (measuring_statistics_) {
    const torch::Tensor flat = x.permute({1, 0, 2, 3}).flatten(1);
    norm.mean.copy_(flat.mean(1));
    const torch::Tensor mean_square = flat.square().mean(1);
    const torch::Tensor variance = flat.var(1, /*unbiased=*/false);
    // A share of the mean square keeps a channel that is constant over the key view from being
    // amplified where another view varies. If the whole layer is constant (a flat picture), the
    // share is 1; else a dozen layers would amplify the smallest change by thousands.
    const double change =
        variance.mean().item<double>() / (mean_square.mean().item<double>() + kNormEpsilon);
    const double share = kMeanSquareShare + std::exp(-change / kFlatChange);
    norm.inverse_deviation.copy_((variance + share * mean_square + kNormEpsilon).rsqrt());
  }
  const torch::Tensor scale = norm.weight * norm.inverse_deviation;
  const torch::Tensor shift = norm.bias - norm.mean * scale;
  return torch::addcmul(shift.view({1, c, 1, 1}), x, scale.view({1, c, 1, 1}));
}

torch::Tensor PersonalModel::Conv(const torch::Tensor& x,
                                  const torch::Tensor& weight,
                                  const torch::Tensor& bias) const {
  const int64_t border = weight.size(2) / 2;
  if (!config_.half_products) return torch::conv2d(x, weight, bias, /*stride=*/1, border);
  const torch::Tensor b = bias.defined() ? bias.to(torch::kBFloat16) : bias;
  return torch::conv2d(
      x.to(torch::kBFloat16), weight.to(torch::kBFloat16), b, /*stride=*/1, border);
}

torch::Tensor PersonalModel::NormalizedConv(const torch::Tensor& x,
                                            const torch::Tensor& weight,
                                            const torch::Tensor& bias,
                                            const Norm& norm) const {
  if (config_.instance_norm || measuring_statistics_) {
    return Normalize(norm, Conv(x, weight, bias));
  }
  // Frozen statistics make the norm linear. It is folded into the weights, which are a hundred
  // times smaller than the activations.
  const torch::Tensor scale = norm.weight * norm.inverse_deviation;
  return Conv(x, weight * scale.view({-1, 1, 1, 1}), norm.bias + (bias - norm.mean) * scale);
}

torch::Tensor PersonalModel::RunBlock(const ResidualBlock& block, const torch::Tensor& x) const {
  torch::Tensor y = LeakyRelu(NormalizedConv(x, block.conv1, block.bias1, block.norm));
  y = LeakyRelu(Conv(y, block.conv2, block.bias2));
  return x + y;
}

torch::Tensor PersonalModel::Adapt(int stage, int block, const torch::Tensor& x) const {
  const std::vector<Adapter>& stage_adapters = adapters_[stage];
  if (stage_adapters.empty()) return {};
  const Adapter& adapter = stage_adapters[block];
  torch::Tensor y = torch::conv2d(x,
                                  adapter.grouped,
                                  adapter.grouped_bias,
                                  /*stride=*/1,
                                  /*padding=*/config_.adapter_kernel / 2,
                                  /*dilation=*/1,
                                  /*groups=*/adapter.grouped.size(0));
  y = torch::conv2d(torch::relu(y), adapter.pointwise, adapter.pointwise_bias);
  return y * adapter.scale;
}

std::vector<torch::Tensor> PersonalModel::Taps(const torch::Tensor& luminance) const {
  const torch::Tensor input = encoder_.Input(luminance);
  if (!config_.HasAdapters()) {
    torch::NoGradGuard no_grad;
    return config_.half_products ? encoder_.FastTaps(input) : encoder_.Taps(input);
  }
  return TapsOfInput(input);
}

std::vector<torch::Tensor> PersonalModel::TapsOfInput(const torch::Tensor& input) const {
  if (!config_.HasAdapters()) return encoder_.Taps(input);
  return encoder_.Taps(input, [this](int stage, int block, const torch::Tensor& x) {
    return Adapt(stage, block, x);
  });
}

// A 1x1 convolution over the concatenation [tap, below upsampled, luminance], part by part: it
// commutes with the upsampling, and concatenating channels-last maps costs more than convolving.
torch::Tensor PersonalModel::Fuse(const Level& level,
                                  const torch::Tensor& tap,
                                  const torch::Tensor& below,
                                  const torch::Tensor& luminance) const {
  torch::Tensor weight = level.fuse;
  torch::Tensor bias = level.fuse_bias;
  const bool frozen = !config_.instance_norm && !measuring_statistics_;
  if (frozen) {
    const torch::Tensor scale = level.norm.weight * level.norm.inverse_deviation;
    weight = weight * scale.view({-1, 1, 1, 1});
    bias = level.norm.bias + (bias - level.norm.mean) * scale;
  }
  int64_t begin = tap.size(1);
  torch::Tensor x = Conv(tap, weight.narrow(1, 0, begin), bias);
  if (below.defined()) {
    x = x + UpsampleTwice(Conv(below, weight.narrow(1, begin, below.size(1)), {}));
    begin += below.size(1);
  }
  if (luminance.defined()) x = x + luminance * weight.narrow(1, begin, 1).view({1, -1, 1, 1});
  return frozen ? x : Normalize(level.norm, x);
}

torch::Tensor PersonalModel::Features(const std::vector<torch::Tensor>& taps,
                                      const torch::Tensor& luminance) const {
  torch::Tensor x;
  for (int i = static_cast<int>(levels_.size()) - 1; i >= 0; --i) {
    const Level& level = levels_[i];
    torch::Tensor l;
    if (i == 0) {
      const int stride = encoder_.config().stem_stride;
      l = torch::avg_pool2d(luminance, {stride, stride}) / 50.0 - 1.0;
    }
    x = LeakyRelu(Fuse(level, taps[i], x, l));
    for (const ResidualBlock& block : level.blocks) x = RunBlock(block, x);
  }
  return x;
}

torch::Tensor PersonalModel::Decode(const std::vector<torch::Tensor>& taps,
                                    const torch::Tensor& luminance) const {
  const torch::Tensor x = Features(taps, luminance);
  const torch::Tensor ab = Conv(x, head_, head_bias_).to(torch::kFloat32);
  return config_.full_resolution ? torch::pixel_shuffle(ab, encoder_.config().stem_stride) : ab;
}

torch::Tensor PersonalModel::Forward(const torch::Tensor& luminance) const {
  return Decode(Taps(luminance), luminance);
}

void PersonalModel::FreezeStatistics(const torch::Tensor& luminance) {
  if (config_.instance_norm) return;
  torch::NoGradGuard no_grad;
  measuring_statistics_ = true;
  Forward(luminance);
  measuring_statistics_ = false;
}

void PersonalModel::RequireGradients(bool on) {
  for (auto& [name, tensor] : parameters_) tensor.set_requires_grad(on);
}

}  // namespace color3d
