// Reader of .splat4d for tests, modelled on the decoder of the format's authors.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace color3d {

// One frame; row i of an n-wide buffer is [i*n, (i+1)*n).
struct Splat4dFrame {
  std::vector<double> position;   // 3
  std::vector<double> log_scale;  // 3
  std::vector<int> color;         // 3: 0..255
  std::vector<int> opacity;       // 1: 0..255
  std::vector<int> rotation;      // 4: -128..127, w x y z
};

struct Splat4dFile {
  double frames_per_second = 0.0;
  double position_bound = 0.0;
  size_t moving = 0;  // Gaussians whose position changes
  std::vector<double> box;
  std::vector<Splat4dFrame> frames;
};

// Throws std::runtime_error if the file violates its format or has unused bytes.
Splat4dFile ReadSplat4d(std::string_view bytes);

}  // namespace color3d
