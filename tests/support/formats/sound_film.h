// Films with sound, written and read by FFmpeg's libraries.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace color3d {

struct GivenSound {
  std::string encoder = "aac";  // FFmpeg's name
  int sample_rate = 48000;
  int channels = 2;
  double begin_s = 0.0;  // from the film's first picture
  double seconds = 1.0;
  std::function<double(double)> level;  // -1..1 at a time (s, as begin_s)
};

// Copies the pictures of `film` and adds sound; the ending of `out` selects the container. Throws
// std::runtime_error.
void AddSound(const std::filesystem::path& film,
              const GivenSound& sound,
              const std::filesystem::path& out);

struct HeardSound {
  std::string codec;  // empty: no sound
  int sample_rate = 0;
  int channels = 0;
  std::vector<float> samples;  // of the first channel; sample 0 belongs to the first picture
};

// Sound as played. Throws std::runtime_error.
HeardSound HearFilm(const std::filesystem::path& film);

}  // namespace color3d
