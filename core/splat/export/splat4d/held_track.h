// Quantization of one attribute of a .splat4d over its frames: constant Gaussians and the steps of
// the others. Internal to the export.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace color3d {

// Quantization steps with errors of at most `bound`.
struct Quantizer {
  int channels = 1;
  double bound = 0.0;
  double step = 1.0;       // of changing values
  double base_step = 1.0;  // of constant values and of first values
};

// Call order: Observe every frame, Close, then Hold every frame.
class HeldTrack {
 public:
  HeldTrack(const Quantizer& quantizer, size_t count);

  // `values`: channels per Gaussian. Values that are not `seen` are ignored.
  void Observe(const std::vector<float>& values, const std::vector<char>& seen);
  void Close();

  bool IsStill(size_t i) const { return still_[i] != 0; }
  // The constant value of a Gaussian, or its first visible one, in steps of base_step.
  int32_t Base(size_t i, int channel) const { return base_[i * quantizer_.channels + channel]; }

  // A visible value; 0 if it is never visible.
  float Low(size_t i, int channel) const { return low_[i * quantizer_.channels + channel]; }
  float High(size_t i, int channel) const { return high_[i * quantizer_.channels + channel]; }

  // Repeats the steps of a Gaussian until their error exceeds the bound, so that jitter below it
  // takes no space.
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
