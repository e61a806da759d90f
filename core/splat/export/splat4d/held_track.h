// One attribute of the Gaussians of a .splat4d over its frames: which of them stay as they are, and
// the steps of those that do not. Internal to the export.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace color3d {

// How an attribute is quantised: nothing is off by more than `bound`.
struct Quantizer {
  int channels = 1;
  double bound = 0.0;
  double step = 1.0;       // of what changes
  double base_step = 1.0;  // of what does not, and of how things begin
};

// First every frame is shown to Observe, then Close, then every frame to Hold.
class HeldTrack {
 public:
  HeldTrack(const Quantizer& quantizer, size_t count);

  // `values`: channels a Gaussian. What is not `seen` may be anywhere.
  void Observe(const std::vector<float>& values, const std::vector<char>& seen);
  void Close();

  bool IsStill(size_t i) const { return still_[i] != 0; }
  // In steps of base_step: where a Gaussian stays, else where it is first seen.
  int32_t Base(size_t i, int channel) const { return base_[i * quantizer_.channels + channel]; }

  // What was seen of it; 0 where nothing was.
  float Low(size_t i, int channel) const { return low_[i * quantizer_.channels + channel]; }
  float High(size_t i, int channel) const { return high_[i * quantizer_.channels + channel]; }

  // A Gaussian keeps its steps until they are off by more than the bound, so that what trembles
  // below that costs nothing.
  void Hold(const std::vector<float>& values, const std::vector<char>& seen);
  int32_t Held(size_t i, int channel) const { return held_[i * quantizer_.channels + channel]; }
  const Quantizer& quantizer() const { return quantizer_; }

 private:
  Quantizer quantizer_;
  std::vector<char> began_, still_;
  std::vector<float> low_, high_, first_;
  std::vector<int32_t> base_, held_;
};

}  // namespace color3d
