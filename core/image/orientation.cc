#include "core/image/orientation.h"

#include <cstdint>

#include "core/image/byte_reader.h"
#include "core/image/probe_formats.h"

namespace color3d {
namespace {

constexpr uint32_t kOrientationTag = 274;

// Offset of the orientation tag's 12-byte entry in the first directory of a TIFF file or an EXIF
// block; 0 when there is none.
size_t FindEntry(std::string_view bytes, bool* big_endian) {
  probe_internal::TiffHeader header;
  if (!probe_internal::ReadTiffHeader(bytes, &header)) return 0;
  *big_endian = header.big_endian;
  const ByteReader reader(bytes, header.big_endian);
  const size_t at = header.first_directory;
  const size_t count = reader.Has(at, 2) ? reader.U16(at) : 0;
  for (size_t i = 0; i < count; ++i) {
    const size_t entry = at + 2 + 12 * i;
    if (!reader.Has(entry, 12)) return 0;
    if (reader.U16(entry) == kOrientationTag) return entry;
  }
  return 0;
}

int OrientationOfTiff(std::string_view bytes) {
  bool big_endian = false;
  const size_t entry = FindEntry(bytes, &big_endian);
  if (entry == 0) return 1;
  const ByteReader reader(bytes, big_endian);
  // A SHORT; some writers use LONG.
  const uint32_t value = reader.U16(entry + 2) == 4 ? reader.U32(entry + 8) : reader.U16(entry + 8);
  return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
}

int OrientationOfJpeg(std::string_view bytes) {
  constexpr std::string_view kExif("Exif\0\0", 6);
  const ByteReader reader(bytes);
  size_t at = 2;
  while (reader.Has(at, 4) && reader.U8(at) == 0xFF) {
    const uint32_t marker = reader.U8(at + 1);
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    if (marker == 0xDA || marker == 0xD9) return 1;
    const size_t length = reader.U16(at + 2);
    if (length < 2) return 1;
    const std::string_view body = reader.Slice(at + 4, length - 2);
    if (marker == 0xE1 && body.substr(0, kExif.size()) == kExif) {
      return OrientationOfTiff(body.substr(kExif.size()));
    }
    at += 2 + length;
  }
  return 1;
}

int OrientationOfPng(std::string_view bytes) {
  const ByteReader reader(bytes);
  size_t at = 8;
  while (reader.Has(at, 12)) {
    const size_t length = reader.U32(at);
    const std::string_view type = reader.Slice(at + 4, 4);
    if (type == "eXIf") return OrientationOfTiff(reader.Slice(at + 8, length));
    if (type == "IEND" || !reader.Has(at + 8, length)) return 1;
    at += 12 + length;
  }
  return 1;
}

}  // namespace

int ReadOrientation(std::string_view bytes) {
  if (probe_internal::IsJpeg(bytes)) return OrientationOfJpeg(bytes);
  if (probe_internal::IsPng(bytes)) return OrientationOfPng(bytes);
  if (probe_internal::IsTiff(bytes)) return OrientationOfTiff(bytes);
  return 1;
}

std::string TiffAsStored(std::string_view bytes) {
  std::string copy(bytes);
  bool big_endian = false;
  const size_t entry = FindEntry(bytes, &big_endian);
  if (entry == 0) return copy;
  const bool is_long = ByteReader(bytes, big_endian).U16(entry + 2) == 4;
  const size_t width = is_long ? 4 : 2;
  for (size_t i = 0; i < 4; ++i) copy[entry + 8 + i] = 0;
  copy[entry + 8 + (big_endian ? width - 1 : 0)] = 1;
  return copy;
}

PictureSize OrientedSize(const ImageInfo& info, int orientation) {
  if (OrientationSwapsSides(orientation)) return {info.height, info.width};
  return {info.width, info.height};
}

}  // namespace color3d
