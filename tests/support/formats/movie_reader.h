// Frames of a movie as shown by a player, decoded and converted by FFmpeg's libraries.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/image.h"

namespace color3d {

struct ReadMovie {
  std::string codec;         // "h264"
  std::string pixel_format;  // "yuv420p"
  int width = 0;
  int height = 0;
  double seconds = 0.0;
  double frames_per_second = 0.0;
  bool index_first = false;   // a browser can start before the download ends
  bool tagged_bt709 = false;  // primaries, transfer and matrix, limited range
  std::vector<double> times;  // of the frames, seconds
  std::vector<Image> frames;  // sRGB in 0..1, 3 channels
};

// Throws std::runtime_error if the movie cannot be decoded.
ReadMovie DecodeMovie(const std::filesystem::path& file);

}  // namespace color3d
