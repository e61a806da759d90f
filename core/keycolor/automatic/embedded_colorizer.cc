// The automatic colourizer that is part of the program: the frozen encoder and a colour head that
// answers with a distribution over colour bins.
#include <fmt/format.h>
#include <torch/types.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/encoder/convnext/convnext.h"
#include "core/encoder/embedded/embedded_weights.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_errors.h"
#include "core/encoder/weight_digest.h"
#include "core/encoder/weight_tensors.h"
#include "core/image/codec.h"
#include "core/image/guided_upsample.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/keycolor/automatic/color_head.h"

namespace color3d {
namespace {

// The network saw things at about these sizes in training; a bigger picture is coloured small and
// brought to its size along the edges of L. Falling.
constexpr int kWorkingSidesPx[] = {320, 224};
// Below the guided filter's default, so that contrasts of 2 L units are edges: this grid is the
// picture at its working size, not cells of several px. Not measured against the default.
constexpr float kFineGridVarianceFloor = 4.0f;
// Spread of the colours in question (Lab units) at which the confidence is one half.
constexpr double kHalfConfidenceSpread = 20.0;

WeightMap WithPrefix(const WeightMap& weights, const std::string& prefix) {
  WeightMap part;
  for (auto i = weights.lower_bound(prefix); i != weights.end() && i->first.starts_with(prefix);
       ++i) {
    part[i->first.substr(prefix.size())] = i->second;
  }
  return part;
}

int RoundTo(double value, int multiple) {
  return std::max(1, static_cast<int>(std::lround(value / multiple))) * multiple;
}

class EmbeddedColorizer : public AutomaticColorizer {
 public:
  explicit EmbeddedColorizer(const WeightMap& weights)
      : encoder_(ConvNextConfig(), WithPrefix(weights, "encoder."), "embedded ConvNeXt"),
        digest_(DigestOfWeights(encoder_.config().ToString(), weights)) {
    WeightReader reader(weights, "the automatic colourizer's weights");
    reader.IgnorePrefix("encoder.");
    const std::vector<int64_t> bins_shape = reader.ShapeOf("color_bins");
    const int64_t bin_count = bins_shape.empty() ? 1 : std::max<int64_t>(1, bins_shape[0]);
    bins_ = TakeTensor(reader, "color_bins", {bin_count, 2});
    temperature_ = reader.Take("color_temperature", {1}).values[0];
    Random random(1);
    head_ = std::make_unique<ColorHead>(encoder_.config(), static_cast<int>(bin_count), random);
    torch::NoGradGuard no_grad;
    for (const auto& [name, tensor] : head_->Parameters()) {
      torch::Tensor target = tensor;
      target.copy_(TakeTensor(reader, "color_head." + name, tensor.sizes().vec()));
    }
    reader.Finish();
    description_ = fmt::format("embedded automatic colourizer, {} colours", bin_count);
  }

  const std::string& description() const override { return description_; }
  const std::string& digest() const override { return digest_; }

  AutomaticColor Colorize(const Image& luminance) const override {
    if (luminance.channels != 1 || luminance.Empty()) {
      throw InvalidArgument("the automatic colourizer takes a picture with 1 channel (L), not {}",
                            luminance.channels);
    }
    return WithTorchErrors("automatic colourizer", [&] {
      torch::NoGradGuard no_grad;
      const torch::Tensor p = MeanProbabilities(luminance);
      const torch::Tensor rows = p.permute({0, 2, 3, 1});
      const torch::Tensor ab = torch::matmul(rows, bins_).permute({0, 3, 1, 2});
      const torch::Tensor variance =
          (torch::matmul(rows, bins_.square().sum(1, true)).permute({0, 3, 1, 2}) -
           ab.square().sum(1, true))
              .clamp_min(0.0);
      const double half = kHalfConfidenceSpread * kHalfConfidenceSpread;
      AutomaticColor result;
      result.ab =
          UpsampleGuided(ImageFromTensor(ab), luminance, kGuideRadius, kFineGridVarianceFloor);
      result.confidence =
          Resize(ImageFromTensor(half / (half + variance)), luminance.width, luminance.height);
      return result;
    });
  }

 private:
  // Annealed distribution (Zhang et al. 2016, eq. 5): a temperature below 1 keeps the mean of the
  // colours in question from being grey.
  torch::Tensor Probabilities(const torch::Tensor& luminance) const {
    return torch::softmax(head_->Forward(encoder_.Taps(encoder_.Input(luminance))) / temperature_,
                          1);
  }

  // The mean over sizes and mirror images: a thing has one colour however near it is and whichever
  // way it looks. [1,K,h,w] on the finest grid.
  torch::Tensor MeanProbabilities(const Image& luminance) const {
    const int stride = encoder_.config().Stride(encoder_.config().StageCount() - 1);
    torch::Tensor sum;
    for (int side : kWorkingSidesPx) {
      const double scale =
          std::min(1.0, static_cast<double>(side) / std::max(luminance.width, luminance.height));
      const torch::Tensor small =
          TensorFromImage(Resize(luminance,
                                 RoundTo(scale * luminance.width, stride),
                                 RoundTo(scale * luminance.height, stride)));
      torch::Tensor p = Probabilities(small) + Probabilities(small.flip(3)).flip(3);
      if (sum.defined()) {
        p = torch::upsample_bilinear2d(p, {sum.size(2), sum.size(3)}, /*align_corners=*/false);
        p = p + sum;
      }
      sum = p;
    }
    return sum / sum.sum(1, /*keepdim=*/true);
  }

  ConvNext encoder_;
  std::unique_ptr<ColorHead> head_;
  torch::Tensor bins_;  // [K,2]
  double temperature_ = 1.0;
  std::string description_;
  std::string digest_;
};

}  // namespace

std::shared_ptr<const AutomaticColorizer> AutomaticColorizer::Embedded() {
  return FromPretrained(EmbeddedWeights(""));
}

std::shared_ptr<const AutomaticColorizer> AutomaticColorizer::FromPretrained(
    const WeightMap& weights) {
  return WithTorchErrors("automatic colourizer",
                         [&] { return std::make_shared<const EmbeddedColorizer>(weights); });
}

}  // namespace color3d
