// Exhaustive matching of SIFT features of two photos. Deterministic. For this folder only. Pure
// functions, thread-safe.
#pragma once

#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

namespace color3d {

// SIFT descriptors of one photo, as COLMAP stores them.
class SiftDescriptors {
 public:
  static constexpr int kDimensions = 128;
  SiftDescriptors() = default;
  // One byte for each dimension, one feature after the other; an incomplete feature at the end is
  // dropped.
  explicit SiftDescriptors(std::string_view bytes);

  int count() const { return static_cast<int>(values_.size()) / kDimensions; }
  const int16_t* Row(int feature) const { return values_.data() + int64_t{feature} * kDimensions; }

 private:
  std::vector<int16_t> values_;
};

// Returns mutual nearest neighbours by index, ascending in a, at an angle of at most 0.7 and less
// than 0.8 of the angle to the second nearest: as COLMAP's exhaustive matcher on the CPU.
std::vector<std::pair<int, int>> MatchDescriptors(const SiftDescriptors& a,
                                                  const SiftDescriptors& b);

}  // namespace color3d
