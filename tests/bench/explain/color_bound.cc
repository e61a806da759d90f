#include "tests/bench/explain/color_bound.h"

#include <torch/types.h>

#include <algorithm>

#include "core/base/error.h"
#include "tests/bench/explain/jacobian.h"

namespace color3d {
namespace {

constexpr double kUnit = 100.0;      // L per unit of a patch
constexpr double kInputStep = 0.25;  // of L, for the derivative of the encoder's input
constexpr int64_t kBatch = 32;       // patches at a time

// Distance of each row.
torch::Tensor Distances(const torch::Tensor& x, const torch::Tensor& y) {
  return (x - y).flatten(1).to(torch::kFloat64).square().sum(1).sqrt();
}

void AddDistances(const PatchColorizer& colorizer,
                  const PatchPairs& pairs,
                  std::vector<PointDistances>* points) {
  const torch::Tensor first = colorizer.Encode(pairs.first);
  const torch::Tensor second = colorizer.Encode(pairs.second);
  const torch::Tensor warped = colorizer.Encode(pairs.warped);
  const torch::Tensor columns =
      torch::stack({Distances(pairs.first, pairs.second),
                    Distances(first, second),
                    Distances(colorizer.Decode(first), colorizer.Decode(second)),
                    Distances(first, warped),
                    Distances(pairs.warped, pairs.second),
                    Distances(warped, second)})
          .contiguous();
  const auto at = columns.accessor<double, 2>();
  for (int64_t i = 0; i < columns.size(1); ++i) {
    points->push_back({at[0][i], at[1][i], at[2][i], at[3][i], at[4][i], at[5][i]});
  }
}

}  // namespace

PatchColorizer::PatchColorizer(const PersonalModel& model, const TapEncoder& encoder, int patch_px)
    : model_(model), encoder_(encoder), patch_px_(patch_px) {
  const ConvNextConfig& config = encoder.config();
  for (int i = 0; i < config.StageCount(); ++i) {
    const int64_t side = patch_px / config.Stride(i);
    if (side * config.Stride(i) != patch_px) {
      throw InvalidArgument("patches of {} px do not fit an encoder with a stride of {} px",
                            patch_px,
                            config.Stride(i));
    }
    tap_shapes_.push_back({config.dims[i], side, side});
  }
}

// The encoder's input has no derivative of its own. It maps each value of L alone, so its first
// order around these values is exact for derivatives here.
torch::Tensor PatchColorizer::Input(const torch::Tensor& luminance) const {
  const torch::Tensor at = luminance.detach();
  const torch::Tensor slope =
      (encoder_.Input(at + kInputStep) - encoder_.Input(at - kInputStep)) / (2.0 * kInputStep);
  return encoder_.Input(at) + slope * (luminance - at);
}

torch::Tensor PatchColorizer::Encode(const torch::Tensor& patches) const {
  const torch::Tensor luminance = patches * kUnit;
  std::vector<torch::Tensor> parts;
  for (const torch::Tensor& tap : model_.TapsOfInput(Input(luminance))) {
    parts.push_back(tap.flatten(1));
  }
  parts.push_back(patches.flatten(1));
  return torch::cat(parts, 1);
}

torch::Tensor PatchColorizer::Decode(const torch::Tensor& codes) const {
  std::vector<torch::Tensor> taps;
  int64_t begin = 0;
  for (const auto& [channels, height, width] : tap_shapes_) {
    const int64_t count = channels * height * width;
    taps.push_back(codes.narrow(1, begin, count).reshape({codes.size(0), channels, height, width}));
    begin += count;
  }
  const int64_t side = patch_px_;
  const torch::Tensor luminance =
      codes.narrow(1, begin, side * side).reshape({codes.size(0), 1, side, side}) * kUnit;
  const torch::Tensor ab = model_.Decode(taps, luminance) * kAbScale;
  const int64_t middle = ab.size(2) / 2 - 1;
  return ab.narrow(2, middle, 2).narrow(3, middle, 2).mean({2, 3});
}

std::vector<PointDistances> MeasurePoints(const PatchColorizer& colorizer,
                                          const PatchPairs& pairs) {
  torch::NoGradGuard no_grad;
  std::vector<PointDistances> points;
  const int64_t count = pairs.first.size(0);
  for (int64_t begin = 0; begin < count; begin += kBatch) {
    const int64_t size = std::min(kBatch, count - begin);
    AddDistances(colorizer,
                 {pairs.first.narrow(0, begin, size),
                  pairs.second.narrow(0, begin, size),
                  pairs.warped.narrow(0, begin, size)},
                 &points);
  }
  return points;
}

JacobianNorms MeasureNorms(const PatchColorizer& colorizer,
                           const torch::Tensor& patches,
                           int iterations) {
  const auto encode = [&](const torch::Tensor& x) { return colorizer.Encode(x); };
  const auto decode = [&](const torch::Tensor& code) { return colorizer.Decode(code); };
  const auto whole = [&](const torch::Tensor& x) { return decode(encode(x)); };
  JacobianNorms norms;
  for (int64_t i = 0; i < patches.size(0); ++i) {
    const torch::Tensor patch = patches.narrow(0, i, 1);
    const uint64_t seed = static_cast<uint64_t>(i) + 1;
    torch::Tensor code;
    {
      torch::NoGradGuard no_grad;
      code = encode(patch);
    }
    norms.encoder = std::max(norms.encoder, JacobianNorm(encode, patch, iterations, seed));
    norms.decoder = std::max(norms.decoder, JacobianNorm(decode, code, iterations, seed));
    norms.whole = std::max(norms.whole, JacobianNorm(whole, patch, iterations, seed));
  }
  return norms;
}

ColorBound CompareWithBound(const std::vector<PointDistances>& points, const JacobianNorms& norms) {
  ColorBound result;
  result.points = static_cast<int64_t>(points.size());
  const auto ratio = [](double x, double y) { return y > 0.0 ? x / y : 0.0; };
  for (const PointDistances& point : points) {
    result.encoder_ratio = std::max(result.encoder_ratio, ratio(point.feature, point.image));
    result.decoder_ratio = std::max(result.decoder_ratio, ratio(point.color, point.feature));
    result.equivariance = std::max(result.equivariance, point.equivariance);
    result.residual =
        std::max(result.residual, point.rest_feature - norms.encoder * point.rest_image);
    result.largest_color = std::max(result.largest_color, point.color);
  }
  const double count = static_cast<double>(points.size());
  for (const PointDistances& point : points) {
    const double bound =
        norms.decoder * (norms.encoder * point.image + result.residual + result.equivariance);
    result.color += point.color / count;
    result.bound += bound / count;
    if (point.color <= bound) result.holds += 1.0 / count;
  }
  return result;
}

}  // namespace color3d
