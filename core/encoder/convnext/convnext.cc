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
#include "core/image/image_checks.h"

namespace color3d {
namespace {

constexpr double kNormEpsilon = 1e-6;
constexpr int kDescribeSidePx = 256;
constexpr int kDeepSidePx = 384;
constexpr int kDeepStridePx = 16;

// Layer norm over the channels of [B,C,H,W]. Copies nothing if x is channels-last.
torch::Tensor ChannelNorm(const torch::Tensor& x, const Layer& norm) {
  return torch::layer_norm(x.permute({0, 2, 3, 1}).to(norm.weight.scalar_type()),
                           {x.size(1)},
                           norm.weight,
                           norm.bias,
                           kNormEpsilon)
      .permute({0, 3, 1, 2});
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
  const auto take = [&](const std::string& name, const std::vector<int64_t>& shape) {
    return parameters_.emplace_back(name, TakeTensor(reader, name, shape)).second;
  };
  const auto layer = [&](const std::string& name, const std::vector<int64_t>& shape) {
    return Layer{take(name + ".weight", shape), take(name + ".bias", {shape[0]})};
  };
  for (int i = 0; i < config.StageCount(); ++i) {
    const int64_t c = config.dims[i];
    const int64_t before = i == 0 ? 3 : config.dims[i - 1];
    const int64_t kernel = i == 0 ? config.stem_kernel : 2;
    const std::string down = fmt::format("downsample_layers.{}.", i);
    Stage stage;
    stage.down = layer(down + (i == 0 ? "0" : "1"), {c, before, kernel, kernel});
    stage.down_norm = layer(down + (i == 0 ? "1" : "0"), {i == 0 ? c : before});
    for (int j = 0; j < config.depths[i]; ++j) {
      const std::string name = fmt::format("stages.{}.{}.", i, j);
      stage.blocks.push_back({layer(name + "dwconv", {c, 1, 7, 7}),
                              layer(name + "norm", {c}),
                              layer(name + "pwconv1", {4 * c, c}),
                              layer(name + "pwconv2", {c, 4 * c}),
                              take(name + "gamma", {c})});
    }
    stage.norm = layer(fmt::format("norm{}", i), {c});
    stages_.push_back(std::move(stage));
  }
  reader.Finish();
}

torch::Tensor ConvNext::Input(const torch::Tensor& luminance) const {
  at::NoGradGuard no_grad;
  return NormalizeInput(GrayFromLuminanceTensor(luminance));
}

torch::Tensor ConvNext::NormalizeInput(const torch::Tensor& rgb) {
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
      x, block.dwconv.weight, block.dwconv.bias, /*stride=*/1, /*padding=*/3, /*dilation=*/1, c);
  if (adapted.defined()) y = y + adapted;
  y = torch::layer_norm(y.permute({0, 2, 3, 1}).to(block.norm.weight.scalar_type()),
                        {c},
                        block.norm.weight,
                        block.norm.bias,
                        kNormEpsilon);
  const auto type = products.first.scalar_type();
  y = torch::gelu(torch::linear(y.to(type), products.first, block.pwconv1.bias.to(type)));
  y = torch::linear(y, products.second, block.pwconv2.bias.to(type)) * block.gamma;
  return x + y.permute({0, 3, 1, 2});
}

torch::Tensor ConvNext::Downsample(int i, const torch::Tensor& x) const {
  const Stage& stage = stages_[i];
  if (i > 0) {
    return torch::conv2d(ChannelNorm(x, stage.down_norm),
                         stage.down.weight,
                         stage.down.bias,
                         /*stride=*/2);
  }
  const int border = (config_.stem_kernel - config_.stem_stride) / 2;
  const torch::Tensor padded =
      border > 0 ? torch::replication_pad2d(x, {border, border, border, border}) : x;
  return ChannelNorm(torch::conv2d(padded, stage.down.weight, stage.down.bias, config_.stem_stride),
                     stage.down_norm);
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
      x = RunBlock(block, {block.pwconv1.weight, block.pwconv2.weight}, x, adapted);
    }
    outputs.push_back(x);
  }
  return outputs;
}

std::vector<torch::Tensor> ConvNext::NormalizeTaps(std::vector<torch::Tensor> outputs) const {
  for (size_t i = 0; i < outputs.size(); ++i) {
    outputs[i] = ChannelNorm(outputs[i], stages_[i].norm);
  }
  return outputs;
}

std::vector<torch::Tensor> ConvNext::Taps(const torch::Tensor& input,
                                          const BlockAdapter& adapter) const {
  return NormalizeTaps(StageOutputs(input, config_.StageCount(), adapter));
}

std::vector<torch::Tensor> ConvNext::FastTaps(const torch::Tensor& input) const {
  at::NoGradGuard no_grad;
  std::call_once(half_once_, [this] {
    for (const Stage& stage : stages_) {
      std::vector<Products>& products = half_products_.emplace_back();
      for (const Block& block : stage.blocks) {
        products.emplace_back(block.pwconv1.weight.to(torch::kBFloat16),
                              block.pwconv2.weight.to(torch::kBFloat16));
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
  return NormalizeTaps(std::move(outputs));
}

torch::Tensor ConvNext::DeepTap(const Image& luminance, int max_side_px, int stage) const {
  RequireLuminance(luminance, "the encoder");
  at::NoGradGuard no_grad;
  const Image small = FitWithin(luminance, max_side_px);
  // Unlike reflection, replication pads pictures of any size, even 1x1.
  const torch::Tensor tensor = PadByReplication(TensorFromImage(small), config_.Stride(stage));
  const torch::Tensor output = StageOutputs(Input(tensor), stage + 1).back();
  return ChannelNorm(output, stages_[stage].norm);
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
