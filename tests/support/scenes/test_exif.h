// JPEGs with EXIF data, for tests.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace color3d {

// An entry of the EXIF directory.
struct ExifTag {
  uint32_t number;
  uint32_t type;  // 3 SHORT, 4 LONG, 5 RATIONAL
  uint32_t value;
  uint32_t denominator = 1;
};

inline void Put(std::string* out, uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out->push_back(static_cast<char>(value >> (8 * i)));
}

// A little-endian EXIF block: a first directory with only the offset of the photo directory, and
// that.
inline std::string ExifBlock(const std::vector<ExifTag>& tags) {
  std::string block("II*\0", 4);
  Put(&block, 8, 4);
  Put(&block, 1, 2);
  Put(&block, 34665, 2), Put(&block, 4, 2), Put(&block, 1, 4), Put(&block, 26, 4);
  Put(&block, 0, 4);
  Put(&block, static_cast<uint32_t>(tags.size()), 2);
  const uint32_t behind = 26 + 2 + 12 * static_cast<uint32_t>(tags.size()) + 4;
  std::string rationals;
  for (const ExifTag& tag : tags) {
    Put(&block, tag.number, 2), Put(&block, tag.type, 2), Put(&block, 1, 4);
    const bool rational = tag.type == 5;
    Put(&block, rational ? behind + static_cast<uint32_t>(rationals.size()) : tag.value, 4);
    if (rational) Put(&rationals, tag.value, 4), Put(&rationals, tag.denominator, 4);
  }
  Put(&block, 0, 4);
  return block + rationals;
}

// A JPEG with the block in APP1, directly after SOI.
inline std::string WithExif(const std::string& jpeg, const std::vector<ExifTag>& tags) {
  const std::string body = std::string("Exif\0\0", 6) + ExifBlock(tags);
  const size_t length = body.size() + 2;
  std::string segment = "\xFF\xE1";
  segment.push_back(static_cast<char>(length >> 8));
  segment.push_back(static_cast<char>(length));
  return jpeg.substr(0, 2) + segment + body + jpeg.substr(2);
}

}  // namespace color3d
