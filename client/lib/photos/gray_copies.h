// What --benchmark and inspect need to know about colour: is it there, and photos without it.
#pragma once

#include <filesystem>
#include <set>
#include <string>

#include "client/lib/photos/photo_folder.h"
#include "core/base/cancellation.h"

namespace color3d::client {

struct ColorCount {
  int looked_at = 0;  // a spread of the photos, at most `max_photos`
  int in_color = 0;
  int unsure = 0;  // photos that may be either (ColorVerdict)
  int photos = 0;

  // True when most of those looked at are.
  bool MostlyColor() const { return 2 * in_color > looked_at; }
  // False when at least half of those looked at may be either.
  bool IsSure() const { return 2 * unsure < looked_at; }
};
// Decodes up to `max_photos` (>= 1) of them, evenly spread. Throws Error{kInvalidArgument} on one
// that cannot be decoded.
ColorCount CountColorPhotos(const PhotoFolder& folder,
                            int max_photos,
                            const CancellationToken& cancel);

struct GrayCopies {
  PhotoFolder folder;              // the same scene paths, with grey bytes
  std::set<std::string> in_color;  // scene paths of the photos that had colour
};
// Grey copies of the photos below `scratch`, one channel, whose L* (CIE) equals the colour photo's:
// JPEG stays JPEG (quality 97), others become 16-bit PNG under the same name, so that names in
// models stay valid. EXIF is not copied; its orientation is applied.
GrayCopies MakeGrayCopies(const PhotoFolder& folder,
                          const std::filesystem::path& scratch,
                          const CancellationToken& cancel);

}  // namespace color3d::client
