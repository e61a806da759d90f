#include "core/splat/training/lab_loss.h"

#include <algorithm>

namespace color3d {
namespace {

// Floats of a channel, padding included.
size_t ChannelFloats(const PlaneBuffer& p) {
  return static_cast<size_t>(p.padded_height) * p.stride;
}

void CopyChannels(const PlaneBuffer& from, int first, int count, PlaneBuffer& to) {
  to.Reset(from.width, from.height, count);
  std::copy_n(from.Row(first, 0), count * ChannelFloats(from), to.Row(0, 0));
}

}  // namespace

LabLossValue LabLoss::Evaluate(const PlaneBuffer& drawn,
                               const PlaneBuffer& target,
                               const PlaneBuffer* pixel_weight,
                               const LossWeights& weights,
                               ThreadPool& pool,
                               PlaneBuffer& gradient) {
  const auto evaluate = [&](int first, int count, const LossWeights& of_part, Part& part) {
    CopyChannels(drawn, first, count, part.drawn);
    CopyChannels(target, first, count, part.target);
    const LossValue value =
        part.loss.Evaluate(part.drawn, part.target, pixel_weight, of_part, pool, part.gradient);
    std::copy_n(
        part.gradient.Row(0, 0), count * ChannelFloats(part.gradient), gradient.Row(first, 0));
    return value;
  };
  gradient.Reset(drawn.width, drawn.height, drawn.channels);
  LossWeights of_ab = weights;
  of_ab.edge = 0.0f;
  LabLossValue value;
  value.l = evaluate(0, 1, weights, l_);
  value.ab = evaluate(1, 2, of_ab, ab_);
  return value;
}

}  // namespace color3d
