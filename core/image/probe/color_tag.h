// The colour space stated in a picture's file. Plain C++, no codec and no colour library. Pure
// function, thread-safe.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace color3d {

struct Chromaticities {  // CIE x, y
  double white_x, white_y, red_x, red_y, green_x, green_y, blue_x, blue_y;
};

// Default: the file states nothing.
struct ColorTag {
  bool is_srgb = false;                     // stated by name
  std::string profile;                      // ICC profile as embedded, unchecked
  double gamma = 0.0;                       // light = value ^ gamma; 0: not stated
  std::optional<Chromaticities> primaries;  // only with a gamma; not stated: those of sRGB
  std::string problem;  // reason why the file's statement cannot be read; else empty
};

// Reads a JPEG's APP2 segments, a PNG's iCCP, sRGB, gAMA and cHRM chunks (in this order), a TIFF
// page's tag 34675, a WebP's ICCP chunk, a HEIC picture's colr box, a BMP's header, else EXIF,
// where cameras state "Adobe RGB" ("R03"). Profiles above 4 MiB are a problem. Never throws; safe
// on hostile input.
ColorTag ReadColorTag(std::string_view bytes);

}  // namespace color3d
