// Lossless WebP of byte data that is not colour. A pure function.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace color3d {

// R G B A bytes, row by row.
struct RgbaTexture {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> rgba;
};

// Bit-exact, including pixels of alpha 0. Throws Error{kInvalidArgument} for more than 16383 pixels
// a side.
std::string EncodeLosslessWebp(const RgbaTexture& texture);

}  // namespace color3d
