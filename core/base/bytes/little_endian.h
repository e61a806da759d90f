// Little-endian integers of binary files.
#pragma once

#include <cstdint>
#include <string>

namespace color3d {

// Appends the lowest `width` bytes, 1..8.
inline void PutLittleEndian(uint64_t value, int width, std::string* out) {
  for (int k = 0; k < width; ++k) out->push_back(static_cast<char>(value >> (8 * k) & 0xffu));
}

}  // namespace color3d
