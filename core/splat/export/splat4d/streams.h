// Symbol streams of a .splat4d. Pure functions. Internal to the export.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace color3d {

// Attribute numbers of the format.
enum Attribute { kPosition, kRotation, kColor, kOpacity, kScale, kAttributes };
enum StreamKind { kKey, kDelta, kStatic };

struct Stream {
  Attribute attribute = kPosition;
  StreamKind kind = kKey;
  std::vector<uint32_t> symbols;
};

struct PackedStream {
  std::string head, payload;
};

// Zigzag coding: 0, -1, 1, -2, ... become 0, 1, 2, 3, ..., so that small numbers have small
// symbols.
inline uint32_t ZigZag(int32_t value) {
  return (static_cast<uint32_t>(value) << 1u) ^ static_cast<uint32_t>(value >> 31);
}

// Throws Error{kResourceExhausted} if memory is short.
PackedStream Pack(const Stream& stream);

}  // namespace color3d
