#include "core/encoder/convnext/convnext.h"

#include <fmt/core.h>
#include <torch/types.h>

#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_errors.h"
#include "core/encoder/weight_digest.h"
#include "core/encoder/weight_tensors.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

constexpr double kNormEpsilon = 1e-6;
constexpr int kDescribeSidePx = 256;
constexpr int kDeepSidePx = 384;
constexpr int kDeepStridePx = 16;

// Layer norm over the channels of [B,C,H,W]. Copies nothing if x is channels-last.
torch::Tensor ChannelNorm(const torch::Tensor& x,
                          const torch::Tensor& weight,
                          const torch::Tensor& bias) {
  return torch::layer_norm(x.permute({0, 2, 3, 1}).to(weight.scalar_type()),
                           {x.size(1)},
                           weight,
                           bias,
                           kNormEpsilon)
      .permute({0, 3, 1, 2});
}

void CheckLuminance(const Image& luminance) {
  if (luminance.channels != 1 || luminance.Empty()) {
    throw InvalidArgument("the encoder takes a picture with 1 channel (L), but got {} channels",
                          luminance.channels);
  }
}

// sRGB grey of L (0..100), elementwise: inverse CIE f, then the sRGB transfer function
// (STILL.md "Colour"; the scalar reference is GrayFromLuminance).
torch::Tensor GrayFromLuminanceTensor(const torch::Tensor& luminance) {
  const torch::Tensor f = (luminance + 16.0) / 116.0;
  const torch::Tensor y = torch::where(luminance > 8.0, f * f * f, luminance * (27.0 / 24389.0));
  const torch::Tensor linear = y.clamp(0.0, 1.0);
  return torch::where(
      linear > 0.0031308, 1.055 * linear.clamp_min(1e-6).pow(1.0 / 2.4) - 0.055, 12.92 * linear);
}

}  // namespace

std::string ConvNextConfig::ToString() const {
  std::string text = fmt::format("convnext stem {}/{} dims", stem_kernel, stem_stride);
  for (int dim : dims) text += fmt::format(" {}", dim);
  text += " depths";
  for (int depth : depths) text += fmt::format(" {}", depth);
  return text;
}

ConvNext::ConvNext(const ConvNextConfig& config, WeightMap weights, std::string description)
    : config_(config),
      digest_(DigestOfWeights(config.ToString(), weights)),
      description_(std::move(description)) {
  WeightReader reader(std::move(weights), "the encoder weights");
  for (int i = 0; i < config.StageCount(); ++i) {
    Stage stage;
    const int64_t c = config.dims[i];
    const std::string down = fmt::format("downsample_layers.{}.", i);
    if (i == 0) {
      stage.down_weight =
          TakeTensor(reader, down + "0.weight", {c, 3, config.stem_kernel, config.stem_kernel});
      stage.down_bias = TakeTensor(reader, down + "0.bias", {c});
      stage.down_norm_weight = TakeTensor(reader, down + "1.weight", {c});
      stage.down_norm_bias = TakeTensor(reader, down + "1.bias", {c});
    } else {
      const int64_t before = config.dims[i - 1];
      stage.down_norm_weight = TakeTensor(reader, down + "0.weight", {before});
      stage.down_norm_bias = TakeTensor(reader, down + "0.bias", {before});
      stage.down_weight = TakeTensor(reader, down + "1.weight", {c, before, 2, 2});
      stage.down_bias = TakeTensor(reader, down + "1.bias", {c});
    }
    for (int j = 0; j < config.depths[i]; ++j) {
      const std::string name = fmt::format("stages.{}.{}.", i, j);
      Block block;
      block.dwconv_weight = TakeTensor(reader, name + "dwconv.weight", {c, 1, 7, 7});
      block.dwconv_bias = TakeTensor(reader, name + "dwconv.bias", {c});
      block.norm_weight = TakeTensor(reader, name + "norm.weight", {c});
      block.norm_bias = TakeTensor(reader, name + "norm.bias", {c});
      block.pwconv1_weight = TakeTensor(reader, name + "pwconv1.weight", {4 * c, c});
      block.pwconv1_bias = TakeTensor(reader, name + "pwconv1.bias", {4 * c});
      block.pwconv2_weight = TakeTensor(reader, name + "pwconv2.weight", {c, 4 * c});
      block.pwconv2_bias = TakeTensor(reader, name + "pwconv2.bias", {c});
      block.gamma = TakeTensor(reader, name + "gamma", {c});
      stage.blocks.push_back(std::move(block));
    }
    stage.norm_weight = TakeTensor(reader, fmt::format("norm{}.weight", i), {c});
    stage.norm_bias = TakeTensor(reader, fmt::format("norm{}.bias", i), {c});
    stages_.push_back(std::move(stage));
  }
  reader.Finish();
}

std::vector<std::pair<std::string, torch::Tensor>> ConvNext::Parameters() const {
  std::vector<std::pair<std::string, torch::Tensor>> parameters;
  for (size_t i = 0; i < stages_.size(); ++i) {
    const Stage& stage = stages_[i];
    const std::string down = fmt::format("downsample_layers.{}.", i);
    const std::string conv = down + (i == 0 ? "0." : "1.");
    const std::string norm = down + (i == 0 ? "1." : "0.");
    parameters.emplace_back(conv + "weight", stage.down_weight);
    parameters.emplace_back(conv + "bias", stage.down_bias);
    parameters.emplace_back(norm + "weight", stage.down_norm_weight);
    parameters.emplace_back(norm + "bias", stage.down_norm_bias);
    for (size_t j = 0; j < stage.blocks.size(); ++j) {
      const Block& block = stage.blocks[j];
      const std::string name = fmt::format("stages.{}.{}.", i, j);
      parameters.emplace_back(name + "dwconv.weight", block.dwconv_weight);
      parameters.emplace_back(name + "dwconv.bias", block.dwconv_bias);
      parameters.emplace_back(name + "norm.weight", block.norm_weight);
      parameters.emplace_back(name + "norm.bias", block.norm_bias);
      parameters.emplace_back(name + "pwconv1.weight", block.pwconv1_weight);
      parameters.emplace_back(name + "pwconv1.bias", block.pwconv1_bias);
      parameters.emplace_back(name + "pwconv2.weight", block.pwconv2_weight);
      parameters.emplace_back(name + "pwconv2.bias", block.pwconv2_bias);
      parameters.emplace_back(name + "gamma", block.gamma);
    }
    parameters.emplace_back(fmt::format("norm{}.weight", i), stage.norm_weight);
    parameters.emplace_back(fmt::format("norm{}.bias", i), stage.norm_bias);
  }
  return parameters;
}

torch::Tensor ConvNext::Input(const torch::Tensor& luminance) const {
  at::NoGradGuard no_grad;
  return NormaliseInput(GrayFromLuminanceTensor(luminance));
}

torch::Tensor ConvNext::NormaliseInput(const torch::Tensor& rgb) {
  const torch::Tensor mean =
      torch::tensor({0.485f, 0.456f, 0.406f}).view({1, 3, 1, 1}).to(rgb.device());
  const torch::Tensor deviation =
      torch::tensor({0.229f, 0.224f, 0.225f}).view({1, 3, 1, 1}).to(rgb.device());
  return ((rgb - mean) / deviation).contiguous(at::MemoryFormat::ChannelsLast);
}

torch::Tensor ConvNext::RunBlock(const Block& block,
                                 const Products& products,
                                 const torch::Tensor& x,
                                 const torch::Tensor& adapted) const {
  const int64_t c = x.size(1);
  torch::Tensor y = torch::conv2d(
      x, block.dwconv_weight, block.dwconv_bias, /*stride=*/1, /*padding=*/3, /*dilation=*/1, c);
  if (adapted.defined()) y = y + adapted;
  y = torch::layer_norm(y.permute({0, 2, 3, 1}).to(block.norm_weight.scalar_type()),
                        {c},
                        block.norm_weight,
                        block.norm_bias,
                        kNormEpsilon);
  const auto type = products.first.scalar_type();
  y = torch::gelu(torch::linear(y.to(type), products.first, block.pwconv1_bias.to(type)));
  y = torch::linear(y, products.second, block.pwconv2_bias.to(type)) * block.gamma;
  return x + y.permute({0, 3, 1, 2});
}

torch::Tensor ConvNext::Downsample(int i, const torch::Tensor& x) const {
  const Stage& stage = stages_[i];
  if (i > 0) {
    return torch::conv2d(ChannelNorm(x, stage.down_norm_weight, stage.down_norm_bias),
                         stage.down_weight,
                         stage.down_bias,
                         /*stride=*/2);
  }
  const int border = (config_.stem_kernel - config_.stem_stride) / 2;
  const torch::Tensor padded =
      border > 0 ? torch::replication_pad2d(x, {border, border, border, border}) : x;
  return ChannelNorm(torch::conv2d(padded, stage.down_weight, stage.down_bias, config_.stem_stride),
                     stage.down_norm_weight,
                     stage.down_norm_bias);
}

std::vector<torch::Tensor> ConvNext::StageOutputs(const torch::Tensor& input,
                                                  int count,
                                                  const BlockAdapter& adapter) const {
  std::vector<torch::Tensor> outputs;
  torch::Tensor x = input;
  for (int i = 0; i < count; ++i) {
    x = Downsample(i, x);
    for (size_t j = 0; j < stages_[i].blocks.size(); ++j) {
      const Block& block = stages_[i].blocks[j];
      torch::Tensor adapted;
      if (adapter) adapted = adapter(i, static_cast<int>(j), x);
      x = RunBlock(block, {block.pwconv1_weight, block.pwconv2_weight}, x, adapted);
    }
    outputs.push_back(x);
  }
  return outputs;
}

std::vector<torch::Tensor> ConvNext::NormaliseTaps(std::vector<torch::Tensor> outputs) const {
  for (size_t i = 0; i < outputs.size(); ++i) {
    outputs[i] = ChannelNorm(outputs[i], stages_[i].norm_weight, stages_[i].norm_bias);
  }
  return outputs;
}

std::vector<torch::Tensor> ConvNext::Taps(const torch::Tensor& input,
                                          const BlockAdapter& adapter) const {
  return NormaliseTaps(StageOutputs(input, config_.StageCount(), adapter));
}

std::vector<torch::Tensor> ConvNext::FastTaps(const torch::Tensor& input) const {
  at::NoGradGuard no_grad;
  std::call_once(half_once_, [this] {
    for (const Stage& stage : stages_) {
      std::vector<Products>& products = half_products_.emplace_back();
      for (const Block& block : stage.blocks) {
        products.emplace_back(block.pwconv1_weight.to(torch::kBFloat16),
                              block.pwconv2_weight.to(torch::kBFloat16));
      }
    }
  });
  std::vector<torch::Tensor> outputs;
  torch::Tensor x = input;
  for (size_t i = 0; i < stages_.size(); ++i) {
    x = Downsample(static_cast<int>(i), x);
    for (size_t j = 0; j < stages_[i].blocks.size(); ++j) {
      x = RunBlock(stages_[i].blocks[j], half_products_[i][j], x, {});
    }
    outputs.push_back(x);
  }
  return NormaliseTaps(std::move(outputs));
}

torch::Tensor ConvNext::DeepTap(const Image& luminance, int max_side_px, int stage) const {
  CheckLuminance(luminance);
  at::NoGradGuard no_grad;
  const Image small = FitWithin(luminance, max_side_px);
  const int stride = config_.Stride(stage);
  const int right = (stride - small.width % stride) % stride;
  const int bottom = (stride - small.height % stride) % stride;
  torch::Tensor tensor = TensorFromImage(small);
  // Unlike reflection, replication pads pictures of any size, even 1x1.
  if (right > 0 || bottom > 0) tensor = torch::replication_pad2d(tensor, {0, right, 0, bottom});
  const torch::Tensor output = StageOutputs(Input(tensor), stage + 1).back();
  return ChannelNorm(output, stages_[stage].norm_weight, stages_[stage].norm_bias);
}

std::vector<double> ConvNext::Describe(const Image& luminance) const {
  return WithTorchErrors("encoder", [&] {
    const torch::Tensor tap =
        DeepTap(luminance, kDescribeSidePx, config_.StageCount() - 1)[0].flatten(1).to(
            torch::kFloat64);
    const torch::Tensor pooled =
        torch::cat({tap.mean(1), tap.std(1, /*unbiased=*/false)}).contiguous();
    const double* values = pooled.data_ptr<double>();
    return std::vector<double>(values, values + pooled.numel());
  });
}

Image ConvNext::DeepFeatures(const Image& luminance) const {
  // Stride 32 of the published networks is too coarse to find the common parts of two views.
  int stage = config_.StageCount() - 1;
  while (stage > 0 && config_.Stride(stage) > kDeepStridePx) --stage;
  return WithTorchErrors("encoder", [&] {
    at::NoGradGuard no_grad;
    return ImageFromTensor(DeepTap(luminance, kDeepSidePx, stage));
  });
}

}  // namespace color3d
