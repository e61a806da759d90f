// Numbers that are functions of a name and an index: the same in tests/reference/*.py, so that
// reference values need no stored inputs. Pure functions.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "core/base/image.h"
#include "core/base/random.h"

namespace color3d {

// FNV-1a of the name, mixed with the index: uniform in [0, 1), 24 bits.
inline double NamedValue(std::string_view name, uint64_t index) {
  uint64_t code = 0xcbf29ce484222325ULL;
  for (const char c : name) code = (code ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return static_cast<double>(MixedBits(code + index) >> 40u) / 16777216.0;
}

inline std::vector<float> NamedValues(std::string_view name,
                                      size_t count,
                                      double low,
                                      double high) {
  std::vector<float> values(count);
  for (size_t i = 0; i < count; ++i) {
    values[i] = static_cast<float>(low + (high - low) * NamedValue(name, i));
  }
  return values;
}

// Noise of 3 channels in 0..1.
inline Image NamedPicture(std::string_view name, int width, int height) {
  Image image(width, height, 3);
  image.data = NamedValues(name, image.data.size(), 0.0, 1.0);
  return image;
}

}  // namespace color3d
