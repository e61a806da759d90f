// Which SIFT features of two photos are of one place: all are compared with all, so that the same
// photos always give the same matches. For this folder only. Pure functions, thread-safe.
#pragma once

#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

namespace color3d {

// COLMAP's descriptors of one photo.
class SiftDescriptors {
 public:
  static constexpr int kDimensions = 128;
  SiftDescriptors() = default;
  // A byte a dimension, one feature after the other; what is left over at the end is dropped.
  explicit SiftDescriptors(std::string_view bytes);

  int count() const { return static_cast<int>(values_.size()) / kDimensions; }
  const int16_t* Row(int feature) const { return values_.data() + int64_t{feature} * kDimensions; }

 private:
  std::vector<int16_t> values_;
};

// Features of a and b, by index, ascending in a, that are each other's nearest, at an angle of at
// most 0.7 and less than 0.8 of that to the second: as COLMAP's exhaustive comparison on the CPU.
std::vector<std::pair<int, int>> MatchDescriptors(const SiftDescriptors& a,
                                                  const SiftDescriptors& b);

}  // namespace color3d
