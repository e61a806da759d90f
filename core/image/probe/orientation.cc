#include "core/image/probe/orientation.h"

#include "core/image/probe/exif.h"
#include "core/image/probe/probe_formats.h"
#include "core/image/probe/tiff_pages.h"

namespace color3d {
namespace {

constexpr unsigned kOrientationTag = 274;

}  // namespace

int ReadOrientation(std::string_view bytes) {
  // HEIC pictures are rotated by properties, which decoders apply.
  if (probe_internal::IsHeif(bytes)) return 1;
  ExifDirectory directory;
  if (!FirstExifDirectory(FindExifBlock(bytes), &directory)) return 1;
  if (probe_internal::IsTiff(bytes)) directory.at = ChosenTiffDirectory(bytes);
  // A SHORT; some writers use LONG.
  const double value = ReadExifNumber(directory, kOrientationTag);
  return value >= 1.0 && value <= 8.0 ? static_cast<int>(value) : 1;
}

PictureSize OrientedSize(const ImageInfo& info, int orientation) {
  if (OrientationSwapsSides(orientation)) return {info.height, info.width};
  return {info.width, info.height};
}

}  // namespace color3d
