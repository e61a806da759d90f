#include "core/image/probe/orientation.h"

#include "core/image/probe/byte_reader.h"
#include "core/image/probe/exif.h"

namespace color3d {
namespace {

constexpr unsigned kOrientationTag = 274;

}  // namespace

int ReadOrientation(std::string_view bytes) {
  ExifDirectory first;
  if (!FirstExifDirectory(FindExifBlock(bytes), &first)) return 1;
  const double value = ReadExifNumber(first, kOrientationTag);  // a SHORT; some writers use LONG
  return value >= 1.0 && value <= 8.0 ? static_cast<int>(value) : 1;
}

std::string TiffAsStored(std::string_view bytes) {
  std::string copy(bytes);
  ExifDirectory first;
  const size_t entry =
      FirstExifDirectory(bytes, &first) ? FindExifEntry(first, kOrientationTag) : 0;
  if (entry == 0) return copy;
  const bool is_long = ByteReader(bytes, first.big_endian).U16(entry + 2) == 4;
  const size_t width = is_long ? 4 : 2;
  for (size_t i = 0; i < 4; ++i) copy[entry + 8 + i] = 0;
  copy[entry + 8 + (first.big_endian ? width - 1 : 0)] = 1;
  return copy;
}

PictureSize OrientedSize(const ImageInfo& info, int orientation) {
  if (OrientationSwapsSides(orientation)) return {info.height, info.width};
  return {info.width, info.height};
}

}  // namespace color3d
