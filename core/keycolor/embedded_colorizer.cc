// The automatic colourizer that is part of the program: the frozen encoder and a colour head that
// answers with a distribution over colour bins.
#include <torch/torch.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/base/error.h"
#include "core/encoder/convnext.h"
#include "core/encoder/embedded/embedded_weights.h"
#include "core/encoder/torch_errors.h"
#include "core/image/codec.h"
#include "core/image/guided_upsample.h"
#include "core/keycolor/automatic.h"
#include "core/keycolor/color_head.h"

namespace color3d {
namespace {

// The network saw things at about these sizes in training; a bigger picture is coloured small and
// brought to its size along the edges of L. Falling.
constexpr int kWorkingSidesPx[] = {320, 224};
constexpr int kGuideRadius = 2;
constexpr float kGuideVarianceFloor = 4.0f;
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

const WeightArray& Require(const WeightMap& weights, const std::string& name) {
  const auto found = weights.find(name);
  if (found == weights.end()) {
    throw InvalidArgument("the automatic colourizer's weights lack \"" + name + "\"");
  }
  return found->second;
}

torch::Tensor TensorFrom(const WeightArray& array) {
  torch::Tensor tensor = torch::empty(array.shape);
  std::memcpy(tensor.data_ptr<float>(), array.values.data(), array.values.size() * sizeof(float));
  return tensor;
}

int RoundTo(double value, int multiple) {
  return std::max(1, static_cast<int>(std::lround(value / multiple))) * multiple;
}

class EmbeddedColorizer : public AutomaticColorizer {
 public:
  explicit EmbeddedColorizer(const WeightMap& weights)
      : encoder_(ConvNextConfig(), WithPrefix(weights, "encoder."), "embedded ConvNeXt"),
        bins_(TensorFrom(Require(weights, "color_bins"))),
        temperature_(Require(weights, "color_temperature").values.at(0)),
        description_("embedded automatic colourizer, " + std::to_string(bins_.size(0)) +
                     " colours"),
        digest_(encoder_.digest()) {
    Random random(1);
    head_ = std::make_unique<ColorHead>(encoder_.config(), static_cast<int>(bins_.size(0)), random);
    torch::NoGradGuard no_grad;
    for (const auto& [name, tensor] : head_->Parameters()) {
      const WeightArray& array = Require(weights, "color_head." + name);
      if (array.shape != tensor.sizes().vec()) {
        throw InvalidArgument("colour head weight \"" + name + "\" has another shape");
      }
      torch::Tensor target = tensor;
      target.copy_(TensorFrom(array));
    }
  }

  const std::string& description() const override { return description_; }
  const std::string& digest() const override { return digest_; }

  AutomaticColor Colorize(const Image& luminance) const override {
    if (luminance.channels != 1 || luminance.Empty()) {
      throw InvalidArgument("the automatic colourizer takes a picture with 1 channel (L), not " +
                            std::to_string(luminance.channels));
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
      result.ab = UpsampleGuided(ImageFromTensor(ab), luminance, kGuideRadius, kGuideVarianceFloor);
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
  double temperature_;
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
