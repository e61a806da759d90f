// The embedded automatic colourizer: the frozen encoder and a colour head that predicts a
// distribution over colour bins.
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
#include "core/image/image_checks.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/keycolor/automatic/color_head.h"

namespace color3d {
namespace {

// Sizes of pictures in training, descending. Larger pictures are coloured at these sizes and
// upsampled, guided by L.
constexpr int kWorkingSidesPx[] = {320, 224};
// Below the guided filter's default, so that contrasts of 2 L units are edges: the grid here has a
// cell per pixel of the working size. Not measured against the default.
constexpr float kFineGridVarianceFloor = 4.0f;
// Expected distance to the true colour (Lab units) at which the confidence is one half.
constexpr double kHalfConfidenceDistance = 20.0;
constexpr int kMedianSteps = 6;
constexpr double kMedianRounding = 3.0;  // Lab units; a third of the spacing of the bins

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

// Geometric median (Weiszfeld) of the colours `bins` [K,2] for rows of probabilities [n,K]: the
// colour of least expected distance to the truth. Unlike the mean, it is near one of the likely
// colours.
torch::Tensor MedianColors(const torch::Tensor& rows, const torch::Tensor& bins) {
  torch::Tensor colors = torch::mm(rows, bins);
  for (int i = 0; i < kMedianSteps; ++i) {
    const torch::Tensor weights = rows / (torch::cdist(colors, bins) + kMedianRounding);
    colors = torch::mm(weights, bins) / weights.sum(1, /*keepdim=*/true);
  }
  return colors;
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
    log_weights_ = torch::zeros({1, bin_count, 1, 1});
    if (weights.contains("color_weights")) {
      log_weights_ = TakeTensor(reader, "color_weights", {bin_count}).log().view({1, -1, 1, 1});
    }
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
    RequireLuminance(luminance, "the automatic colourizer");
    return WithTorchErrors("automatic colourizer", [&] {
      torch::NoGradGuard no_grad;
      const torch::Tensor p = MeanProbabilities(luminance)[0];
      const torch::Tensor rows = p.flatten(1).t().contiguous();
      const torch::Tensor colors = MedianColors(rows, bins_);
      const torch::Tensor distance = (rows * torch::cdist(colors, bins_)).sum(1);
      const auto picture = [&p](const torch::Tensor& cells) {
        return ImageFromTensor(cells.t().reshape({1, -1, p.size(1), p.size(2)}));
      };
      const torch::Tensor confidence = 1.0 / (1.0 + (distance / kHalfConfidenceDistance).square());
      AutomaticColor result;
      result.ab = UpsampleGuided(picture(colors), luminance, kGuideRadius, kFineGridVarianceFloor);
      result.confidence =
          Resize(picture(confidence.unsqueeze(1)), luminance.width, luminance.height);
      return result;
    });
  }

 private:
  // Training overcounted rare colours; color_weights undoes a part of that.
  torch::Tensor Probabilities(const torch::Tensor& luminance) const {
    const torch::Tensor logits = head_->Forward(encoder_.Taps(encoder_.Input(luminance)));
    return torch::softmax((logits - log_weights_) / temperature_, 1);
  }

  // Mean over sizes and mirror images, since colours depend on neither. [1,K,h,w] on the finest
  // grid.
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
  torch::Tensor bins_;         // [K,2]
  torch::Tensor log_weights_;  // [1,K,1,1]
  double temperature_ = 1.0;
  std::string description_;
  std::string digest_;
};

}  // namespace

std::shared_ptr<const AutomaticColorizer> AutomaticColorizer::Embedded() {
  static const std::shared_ptr<const AutomaticColorizer> embedded =
      FromPretrained(EmbeddedWeights(""));
  return embedded;
}

std::shared_ptr<const AutomaticColorizer> AutomaticColorizer::FromPretrained(
    const WeightMap& weights) {
  return WithTorchErrors("automatic colourizer",
                         [&] { return std::make_shared<const EmbeddedColorizer>(weights); });
}

}  // namespace color3d
