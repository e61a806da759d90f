#include "core/splat/export/splat4d/streams.h"

#include <algorithm>

#include "core/base/bytes/little_endian.h"
#include "core/splat/export/zstd.h"

namespace color3d {

// All lowest bytes, then all next ones, so that similar bytes are adjacent.
PackedStream Pack(const Stream& stream) {
  uint32_t largest = 0;
  for (const uint32_t s : stream.symbols) largest = std::max(largest, s);
  const int width = largest < 1u << 8u ? 1 : largest < 1u << 16u ? 2 : 4;
  std::string planes;
  planes.reserve(width * stream.symbols.size());
  for (int byte = 0; byte < width; ++byte) {
    for (const uint32_t s : stream.symbols) planes.push_back(static_cast<char>(s >> (8 * byte)));
  }
  PackedStream packed{"", Zstd(planes)};
  PutLittleEndian(stream.attribute, 1, &packed.head);
  PutLittleEndian(stream.kind, 1, &packed.head);
  PutLittleEndian(width, 1, &packed.head);
  PutLittleEndian(stream.symbols.size(), 4, &packed.head);
  PutLittleEndian(packed.payload.size(), 4, &packed.head);
  return packed;
}

}  // namespace color3d
