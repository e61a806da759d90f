// What a picture's file says its numbers mean as colours. Plain C++, no codec and no colour
// library. Pure function, thread-safe.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace color3d {

struct Chromaticities {  // CIE x, y
  double white_x, white_y, red_x, red_y, green_x, green_y, blue_x, blue_y;
};

// Nothing set: the file says nothing.
struct ColorTag {
  bool is_srgb = false;                     // it says so by name
  std::string profile;                      // ICC, as embedded: not checked yet
  double gamma = 0.0;                       // light = value ^ gamma; 0: not said
  std::optional<Chromaticities> primaries;  // with a gamma; not said: those of sRGB
  std::string problem;                      // why what the file says cannot be read; else empty
};

// Of a JPEG's APP2 segments, a PNG's iCCP, sRGB, gAMA and cHRM chunks (in this order), a TIFF
// page's tag 34675, a WebP's ICCP chunk, a HEIC picture's colr box, a BMP's header, else of EXIF,
// where cameras say "Adobe RGB" ("R03"). Profiles above 4 MiB are a problem. Never throws; safe on
// hostile input.
ColorTag ReadColorTag(std::string_view bytes);

}  // namespace color3d
