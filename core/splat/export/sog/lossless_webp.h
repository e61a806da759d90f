// Pictures of bytes that mean something else than colour, kept bit for bit. A pure function.
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

// Bit for bit, also where alpha is 0. Throws Error{kInvalidArgument} for more than 16383 pixels a
// side.
std::string EncodeLosslessWebp(const RgbaTexture& texture);

}  // namespace color3d
