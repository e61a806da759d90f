#include "core/image/probe/focal_length.h"

#include <algorithm>
#include <cmath>

#include "core/image/probe/exif.h"
#include "core/image/probe/tiff_pages.h"

namespace color3d {
namespace {

// EXIF 2.3 tags.
constexpr unsigned kFocalLength = 37386;  // mm
constexpr unsigned kPixelXDimension = 40962;
constexpr unsigned kFocalPlaneXResolution = 41486;  // px per unit
constexpr unsigned kFocalPlaneResolutionUnit = 41488;
constexpr unsigned kFocalLengthIn35mmFilm = 41989;  // mm

double UnitMm(double unit) {
  if (unit == 3.0) return 10.0;
  if (unit == 4.0) return 1.0;
  if (unit == 5.0) return 1e-3;
  return 25.4;  // inch, which is the default, too
}

}  // namespace

double ReadFocalLengthPx(std::string_view bytes, int width, int height) {
  ExifDirectory first, photo;
  if (!FirstExifDirectory(FindExifBlock(bytes), &first)) return 0.0;
  if (!PhotoExifDirectory(first, &photo)) {
    // In TIFFs with a preview before the picture.
    if (const size_t chosen = ChosenTiffDirectory(bytes); chosen != 0) first.at = chosen;
    if (!PhotoExifDirectory(first, &photo)) return 0.0;
  }
  constexpr double kFilmDiagonalMm = 43.2666;  // 36 x 24
  double focal_px =
      ReadExifNumber(photo, kFocalLengthIn35mmFilm) * std::hypot(width, height) / kFilmDiagonalMm;
  if (focal_px == 0.0) {
    // The resolution refers to the pixels as taken; the file may be a reduced copy.
    const double taken_width = ReadExifNumber(photo, kPixelXDimension);
    const double px_per_mm = ReadExifNumber(photo, kFocalPlaneXResolution) /
                             UnitMm(ReadExifNumber(photo, kFocalPlaneResolutionUnit));
    const double scale = taken_width > 0.0 ? width / taken_width : 1.0;
    focal_px = ReadExifNumber(photo, kFocalLength) * px_per_mm * scale;
  }
  const double longer = std::max(width, height);
  return focal_px >= 0.2 * longer && focal_px <= 8.0 * longer ? focal_px : 0.0;
}

}  // namespace color3d
