#include "core/splat/export/splat4d/held_track.h"

#include <algorithm>
#include <cmath>

namespace color3d {
namespace {

constexpr double kRounding = 1e-6;  // relative

int32_t Steps(double value, double step) { return static_cast<int32_t>(std::lround(value / step)); }

}  // namespace

HeldTrack::HeldTrack(const Quantizer& quantizer, size_t count)
    : quantizer_(quantizer),
      began_(count, 0),
      still_(count, 1),
      low_(count * quantizer.channels),
      high_(low_.size()),
      first_(low_.size()),
      base_(low_.size()) {}

void HeldTrack::Observe(const std::vector<float>& values, const std::vector<char>& seen) {
  for (size_t k = 0; k < values.size(); ++k) {
    const size_t i = k / quantizer_.channels;
    if (seen[i] == 0) continue;
    if (began_[i] == 0) low_[k] = high_[k] = first_[k] = values[k];
    low_[k] = std::min(low_[k], values[k]);
    high_[k] = std::max(high_[k], values[k]);
    if (k % quantizer_.channels == static_cast<size_t>(quantizer_.channels) - 1) began_[i] = 1;
  }
}

void HeldTrack::Close() {
  const double step = quantizer_.base_step, bound = quantizer_.bound * (1.0 + kRounding);
  for (size_t k = 0; k < base_.size(); ++k) {
    base_[k] = Steps(0.5 * (static_cast<double>(low_[k]) + high_[k]), step);
    const double value = base_[k] * step;
    if (value < high_[k] - bound || value > low_[k] + bound) still_[k / quantizer_.channels] = 0;
  }
  held_.resize(base_.size());
  for (size_t k = 0; k < base_.size(); ++k) {
    if (still_[k / quantizer_.channels] != 0) continue;
    base_[k] = Steps(first_[k], step);
    held_[k] = Steps(first_[k], quantizer_.step);
  }
}

void HeldTrack::Hold(const std::vector<float>& values, const std::vector<char>& seen) {
  const int channels = quantizer_.channels;
  const double bound = quantizer_.bound * (1.0 + kRounding);
  for (size_t i = 0; i < still_.size(); ++i) {
    if (still_[i] != 0 || seen[i] == 0) continue;
    bool off = false;
    for (int c = 0; c < channels; ++c) {
      const size_t k = i * channels + c;
      off |= std::abs(values[k] - held_[k] * quantizer_.step) > bound;
    }
    for (int c = 0; off && c < channels; ++c) {
      held_[i * channels + c] = Steps(values[i * channels + c], quantizer_.step);
    }
  }
}

}  // namespace color3d
