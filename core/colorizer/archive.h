// A small container for named arrays: colorizer files and training checkpoints. Self-checking
// (SHA-256), so damaged or hostile bytes are refused before anything is used. No torch.
//
// Layout, little-endian: magic (8 bytes), version u32, header length u32, header (JSON), array
// count u32, then per array: name length u32, name, type u8, rank u8, rank x i64, raw values; last
// the SHA-256 of all that precedes as 64 hexadecimal digits.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace color3d {

struct ArchiveArray {
  enum class Type : uint8_t { kFloat32 = 0, kFloat16 = 1 };
  Type type = Type::kFloat32;
  std::vector<int64_t> shape;
  std::string bytes;  // row-major, little-endian
};

struct Archive {
  uint32_t version = 1;
  std::string header;  // JSON text
  std::map<std::string, ArchiveArray> arrays;
};

// `magic` has exactly 8 characters.
std::string WriteArchive(const Archive& archive, std::string_view magic);
// Throws Error{kInvalidArgument}, starting with `what` ("the colorizer file"), when the bytes are
// of another kind or version, cut short or changed.
Archive ReadArchive(std::string_view bytes,
                    std::string_view magic,
                    uint32_t version,
                    const std::string& what);

}  // namespace color3d
