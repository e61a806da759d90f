// Films of known tones in any codec, pixel format and container, by FFmpeg's libraries.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace color3d {

// One stream of pictures; names are FFmpeg's.
struct ToneStream {
  std::string encoder = "ffv1";
  std::string pixel_format = "gray";
  int width = 64, height = 48;  // px
  // Tags of the stream; empty: none.
  std::string range = {};      // "tv", "pc"
  std::string transfer = {};   // "smpte2084", "arib-std-b67"
  std::string primaries = {};  // "bt2020"
  bool is_default = false;
  // Coded grey in 0..1 at a share of the width; in limited ranges, between black and white.
  std::function<double(double)> tone = [](double x) { return x; };
};

// Writes three equal frames at 25 per second; the ending of `file` selects the container. Returns
// false if FFmpeg's libraries lack the encoder. Throws std::runtime_error.
bool WriteToneFilm(const std::filesystem::path& file, const std::vector<ToneStream>& streams);

}  // namespace color3d
