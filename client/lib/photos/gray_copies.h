// Colour check and grey copies of photos, for --benchmark and inspect.
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

  // Returns true if most of the photos checked are in colour.
  bool MostlyColor() const { return 2 * in_color > looked_at; }
  // Returns false if at least half of the photos checked are ambiguous.
  bool IsSure() const { return 2 * unsure < looked_at; }
};
// Decodes up to `max_photos` (>= 1) photos, evenly spread. Throws Error{kInvalidArgument} if one
// cannot be decoded.
ColorCount CountColorPhotos(const PhotoFolder& folder,
                            int max_photos,
                            const CancellationToken& cancel);

struct GrayCopies {
  PhotoFolder folder;              // the same scene paths, with grey bytes
  std::set<std::string> in_color;  // scene paths of the photos that had colour
};
// Writes grey copies of the photos below `scratch`, one channel, with the L* (CIE) of the colour
// photo: JPEG stays JPEG (quality 97), other formats become 16-bit PNG under the same name, so that
// names in models stay valid. EXIF orientation is applied; other EXIF data is dropped.
GrayCopies MakeGrayCopies(const PhotoFolder& folder,
                          const std::filesystem::path& scratch,
                          const CancellationToken& cancel);

}  // namespace color3d::client
