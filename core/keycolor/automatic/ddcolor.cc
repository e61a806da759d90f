#include "core/keycolor/automatic/ddcolor.h"

#include <fmt/format.h>
#include <torch/types.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/encoder/convnext/convnext.h"
#include "core/encoder/convnext/convnext_weights.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_errors.h"
#include "core/encoder/weight_digest.h"
#include "core/image/codec.h"
#include "core/image/guided_upsample.h"
#include "core/image/image_checks.h"
#include "core/keycolor/automatic/ddcolor_decoder.h"
#include "core/weights/weight_file.h"

namespace color3d {
namespace {

constexpr int kNetworkSidePx = 512;

}  // namespace

bool Ddcolor::Recognizes(const WeightMap& weights) {
  return weights.count("decoder.color_decoder.query_feat.weight") > 0 ||
         weights.count("refine_net.0.0.weight_orig") > 0;
}

Ddcolor::Ddcolor(WeightMap weights) : digest_(DigestOfWeights("DDColor", weights)) {
  WithTorchErrors("DDColor", [&] {
    at::NoGradGuard no_grad;
    ConvNextWeights encoder = TakeConvNextWeights(weights);
    encoder_ = std::make_unique<const ConvNext>(
        encoder.config, std::move(encoder.weights), encoder.description);
    if (encoder.config.StageCount() != 4 || encoder.config.stem_stride != 4) {
      throw InvalidArgument("the DDColor weights have an encoder of another kind: {}",
                            encoder.config.ToString());
    }
    WeightReader reader(std::move(weights), "the DDColor weights");
    reader.IgnorePrefix("mean");  // ImageNet's statistics, applied by Input()
    reader.IgnorePrefix("std");
    decoder_ = std::make_unique<const DdcolorDecoder>(encoder.config.dims, reader);
  });
  description_ = fmt::format(
      "DDColor, {}, {} colour queries", encoder_->config().ToString(), decoder_->query_count());
}

Ddcolor::~Ddcolor() = default;

Image Ddcolor::Predict(const Image& gray_rgb) const {
  if (gray_rgb.channels != 3 || gray_rgb.Empty() || gray_rgb.width % 32 != 0 ||
      gray_rgb.height % 32 != 0) {
    throw InvalidArgument(
        "DDColor takes 3 channels and sides that are multiples of 32 px, not {}x{} with {}",
        gray_rgb.width,
        gray_rgb.height,
        gray_rgb.channels);
  }
  return WithTorchErrors("DDColor", [&] {
    at::NoGradGuard no_grad;
    const torch::Tensor input = ConvNext::NormalizeInput(TensorFromImage(gray_rgb));
    return ImageFromTensor(decoder_->Forward(encoder_->Taps(input), input));
  });
}

AutomaticColor Ddcolor::Colorize(const Image& luminance) const {
  RequireLuminance(luminance, "the automatic colourizer");
  if (!IsFinite(luminance)) {
    throw InvalidArgument("the luminance to colour has a value that is not finite");
  }
  const Image coarse = WithTorchErrors("DDColor", [&] {
    at::NoGradGuard no_grad;
    const Image square = Resize(luminance, kNetworkSidePx, kNetworkSidePx);
    const torch::Tensor input = encoder_->Input(TensorFromImage(square));
    return ImageFromTensor(decoder_->Forward(encoder_->Taps(input), input));
  });
  const bool enlarges = luminance.width > coarse.width || luminance.height > coarse.height;
  AutomaticColor color;
  color.ab = enlarges ? UpsampleGuided(coarse, luminance)
                      : Resize(coarse, luminance.width, luminance.height);
  color.confidence = Image(luminance.width, luminance.height, 1, 1.0f);
  return color;
}

std::shared_ptr<const AutomaticColorizer> AutomaticColorizer::FromWeightFile(
    const std::filesystem::path& ddcolor_weights) {
  WeightMap weights = ReadWeightFile(ddcolor_weights);
  if (!Ddcolor::Recognizes(weights)) {
    throw InvalidArgument(
        "{} contains no DDColor model (it has {} arrays, none called refine_net.0.0.weight_orig); "
        "give a published DDColor file",
        ddcolor_weights.string(),
        weights.size());
  }
  return std::make_shared<const Ddcolor>(std::move(weights));
}

}  // namespace color3d
