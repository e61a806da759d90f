// The streams of symbols that a .splat4d is made of. Pure functions. Internal to the export.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace color3d {

// Attributes as the format numbers them.
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

// 0, -1, 1, -2, ... as 0, 1, 2, 3, ...: small numbers of either sign have small symbols.
inline uint32_t ZigZag(int32_t value) {
  return (static_cast<uint32_t>(value) << 1u) ^ static_cast<uint32_t>(value >> 31);
}

// Throws Error{kResourceExhausted} where memory is short.
PackedStream Pack(const Stream& stream);

}  // namespace color3d
