#include "tests/bench/explain/answer_variance.h"

#include <torch/types.h>

#include <algorithm>

#include "core/colorizer/training/view_change.h"

namespace color3d {
namespace {

constexpr double kInside = 0.99;  // weight of a place whose neighbours are inside, too

}  // namespace

AnswerSpread MeasureSpread(const Answer& answer,
                           const torch::Tensor& luminance,
                           int draws,
                           uint64_t seed) {
  torch::NoGradGuard no_grad;
  Random random(seed, /*stream=*/5);
  torch::Tensor count, sum, squares;
  for (int i = 0; i < draws; ++i) {
    const ViewChange change = ViewChange::Draw(random);
    const int64_t height = luminance.size(2), width = luminance.size(3);
    const AffineMap map = change.Positions(height, width);
    const torch::Tensor given = Warp(luminance, SamplingGrid(map, height, width), Border::kReflect);
    const torch::Tensor ab = answer(change.InLight(given));
    const torch::Tensor back = SamplingGrid(Inverse(map), ab.size(2), ab.size(3));
    const torch::Tensor inside =
        (Warp(torch::ones_like(ab.narrow(1, 0, 1)), back, Border::kZero) > kInside)
            .to(torch::kFloat64);
    const torch::Tensor mapped = Warp(ab, back, Border::kRepeat).to(torch::kFloat64) * inside;
    if (i == 0) {
      count = torch::zeros_like(inside);
      sum = torch::zeros_like(mapped);
      squares = torch::zeros_like(mapped);
    }
    count += inside;
    sum += mapped;
    squares += mapped.square();
  }
  const torch::Tensor counted =
      (count >= std::max(2.0, 0.5 * draws)).to(torch::kFloat64);  // places that count
  const double places = counted.sum().item<double>();
  AnswerSpread spread;
  spread.places = places / static_cast<double>(counted.numel());
  if (places == 0.0) return spread;
  const torch::Tensor mean = sum / count.clamp_min(1.0);
  const torch::Tensor variance =
      (squares - sum * mean).clamp_min(0.0).sum(1, /*keepdim=*/true) / (count - 1.0).clamp_min(1.0);
  spread.variance = (variance * counted).sum().item<double>() / places;
  spread.chroma =
      (mean.square().sum(1, /*keepdim=*/true).sqrt() * counted).sum().item<double>() / places;
  return spread;
}

}  // namespace color3d
