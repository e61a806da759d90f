// Focal length of a photo from its EXIF data. Plain C++, no codec. Pure function, thread-safe.
#pragma once

#include <string_view>

namespace color3d {

// Focal length in pixels of the picture as stored, which is `width` x `height`; 0 if the file does
// not state it or the value is outside 0.2 to 8 times the longer side. Uses FocalLengthIn35mmFilm
// (equal diagonals, CIPA DCG-001), else FocalLength with the sensor's resolution. Safe on hostile
// input.
double ReadFocalLengthPx(std::string_view bytes, int width, int height);

}  // namespace color3d
