#include "core/colorizer/exemplar/exemplar_head.h"

#include <ATen/ops/conv2d.h>
#include <torch/types.h>

#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/colorizer/exemplar/exemplar_weights.h"
#include "core/colorizer/model/personal_model.h"
#include "core/encoder/image_tensors.h"
#include "core/weights/safetensors.h"

namespace color3d {
namespace {

constexpr int kFirstTap = 2, kTaps = 2;  // taps of strides 8 and 16
constexpr int64_t kTapChannels = 12;     // of each tap, after projection
constexpr int64_t kFoundChannels = 5;    // a, b, distance, deviation, L
constexpr int64_t kWidth = 40;
constexpr double kMaxDistance = 6.0, kDeviationScale = 20.0;

double InitialDeviation(int64_t inputs) { return std::sqrt(2.0 / static_cast<double>(inputs)); }

}  // namespace

ExemplarHead::ExemplarHead(const ConvNextConfig& encoder, Random& random) {
  for (int i = 0; i < kTaps; ++i) {
    const int64_t in = encoder.dims.at(kFirstTap + i);
    New("tap" + std::to_string(i), {kTapChannels, in, 1, 1}, 0.1 * InitialDeviation(in), random);
  }
  const int64_t in = kFoundChannels + kTaps * kTapChannels;
  New("conv1.weight", {kWidth, in, 3, 3}, InitialDeviation(9 * in), random);
  New("conv1.bias", {kWidth}, 0.0, random);
  New("conv2.weight", {kWidth, kWidth, 3, 3}, InitialDeviation(9 * kWidth), random);
  New("conv2.bias", {kWidth}, 0.0, random);
  New("conv3.weight", {3, kWidth, 3, 3}, 0.0, random);
  New("conv3.bias", {3}, 0.0, random);
}

torch::Tensor ExemplarHead::New(const std::string& name,
                                std::vector<int64_t> shape,
                                double deviation,
                                Random& random) {
  torch::Tensor tensor = torch::zeros(shape);
  float* values = tensor.data_ptr<float>();
  for (int64_t i = 0; deviation > 0.0 && i < tensor.numel(); ++i) {
    values[i] = static_cast<float>(deviation * random.NextNormal());
  }
  parameters_.emplace_back(name, tensor);
  return tensor;
}

std::shared_ptr<const ExemplarHead> ExemplarHead::Embedded(const TapEncoder& encoder) {
  if (encoder.digest() != Encoder::Embedded()->digest()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "the feed-forward recipe works with the embedded encoder only, but the encoder is "
                "{}; leave personalize.encoder out, or choose another personalize.recipe",
                encoder.description());
  }
  Random random(0);
  auto head = std::make_shared<ExemplarHead>(encoder.config(), random);
  head->SetWeights(ParseSafetensors(ExemplarWeightFile()));
  return head;
}

torch::Tensor ExemplarHead::Refine(const std::vector<torch::Tensor>& taps,
                                   const torch::Tensor& luminance,
                                   const NeighborColors& found) const {
  const auto parameter = [&](size_t i) { return parameters_[i].second; };
  const std::vector<int64_t> size = {found.ab.size(1), found.ab.size(2)};
  const torch::Tensor ab = found.ab.unsqueeze(0);
  const auto plane = [](const torch::Tensor& map) { return map.unsqueeze(0).unsqueeze(0); };
  std::vector<torch::Tensor> inputs = {
      ab / kAbScale,
      plane(found.distance).clamp_max(kMaxDistance) / kMaxDistance,
      plane(found.variance).clamp_min(0.0).sqrt() / kDeviationScale,
      torch::avg_pool2d(luminance, {kCellPx, kCellPx}) / 50.0 - 1.0};
  for (int i = 0; i < kTaps; ++i) {
    inputs.push_back(
        torch::upsample_bilinear2d(torch::conv2d(taps.at(kFirstTap + i).contiguous(), parameter(i)),
                                   size,
                                   /*align_corners=*/false));
  }
  torch::Tensor x = torch::cat(inputs, 1);
  x = torch::relu(torch::conv2d(x, parameter(2), parameter(3), /*stride=*/1, /*padding=*/1));
  x = torch::relu(
      torch::conv2d(x, parameter(4), parameter(5), /*stride=*/1, /*padding=*/2, /*dilation=*/2));
  x = torch::conv2d(x, parameter(6), parameter(7), /*stride=*/1, /*padding=*/1);
  const torch::Tensor gain = 2.0 * torch::sigmoid(x.slice(1, 2, 3));
  return (ab * gain + kAbScale * x.slice(1, 0, 2)).squeeze(0);
}

WeightMap ExemplarHead::Weights() const {
  WeightMap weights;
  for (const auto& [name, tensor] : parameters_) {
    weights[name] = {tensor.sizes().vec(), TensorValues(tensor.detach())};
  }
  return weights;
}

void ExemplarHead::SetWeights(const WeightMap& weights) {
  torch::NoGradGuard no_grad;
  for (auto& [name, tensor] : parameters_) {
    const auto found = weights.find(name);
    if (found == weights.end() || found->second.shape != tensor.sizes().vec()) {
      throw InvalidArgument(
          "the weights of the feed-forward colorizer have no array {} of {} values",
          name,
          tensor.numel());
    }
    torch::Tensor target = tensor;
    target.copy_(torch::tensor(found->second.values).reshape(tensor.sizes()));
  }
}

}  // namespace color3d
