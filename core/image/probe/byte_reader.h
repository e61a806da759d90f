// Bounds-checked integers out of a byte string. A plain view: the bytes must outlive it. For
// this folder only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace color3d {

class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes, bool big_endian = true)
      : bytes_(bytes), big_endian_(big_endian) {}

  size_t size() const { return bytes_.size(); }
  // Returns true if [offset, offset + count) lies inside; never overflows.
  bool Has(size_t offset, size_t count) const {
    return offset <= bytes_.size() && count <= bytes_.size() - offset;
  }
  // The caller checks Has() first; reads zero outside the bytes.
  uint32_t U8(size_t offset) const {
    return offset < bytes_.size() ? static_cast<unsigned char>(bytes_[offset]) : 0u;
  }
  uint32_t U16(size_t offset) const {
    const uint32_t first = U8(offset), second = U8(offset + 1);
    return big_endian_ ? first << 8 | second : second << 8 | first;
  }
  uint32_t U32(size_t offset) const {
    const uint32_t first = U16(offset), second = U16(offset + 2);
    return big_endian_ ? first << 16 | second : second << 16 | first;
  }
  std::string_view Slice(size_t offset, size_t count) const {
    return Has(offset, count) ? bytes_.substr(offset, count) : std::string_view();
  }

 private:
  std::string_view bytes_;
  bool big_endian_;
};

}  // namespace color3d
