// Motion of a scene's Gaussians for players: a compact file beside that of the Gaussians
// (FORMAT.md in this folder; DYNAMIC.md "Motion"). Pure functions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace color3d {

// Gaussians that move, of a file that also has others. With t = -1 at begin_s, 1 at end_s and
// tau = t - center:
//   position + velocity tau + acceleration tau^2,  rotation (1 + spin tau), normalised,
//   opacity exp(-(tau / exp(log_width))^2 / 2)
// Lengths are in the units of that file. Row i of an n-wide buffer is [i*n, (i+1)*n).
struct MovingGaussians {
  double begin_s = 0.0;
  double end_s = 0.0;               // >= begin_s
  uint32_t total = 0;               // Gaussians of the file
  std::vector<uint32_t> index;      // 1: place in the file, ascending
  std::vector<float> center;        // 1: t
  std::vector<float> log_width;     // 1
  std::vector<float> velocity;      // 3: per unit of t
  std::vector<float> acceleration;  // 3
  std::vector<float> spin;          // 4: quaternion w x y z, from the right of the unit rotation

  size_t size() const { return index.size(); }
};

// Returns the largest |tau| at which a Gaussian can be seen in t = -1..1. Quantized motion is
// relative to it.
float MotionReach(float center, float log_width);

// Writes version 1, 72 + total / 8 + 20 * size() bytes, not yet compressed. Windows narrower than
// 1e-5 or wider than 33 units of t become as wide as that. Errors: FORMAT.md "Precision". Throws
// Error{kInvalidArgument} if sizes disagree, places are not ascending or beyond `total`, or a value
// is not finite.
std::string EncodeMotion(const MovingGaussians& moving);

// Throws Error{kInvalidArgument} for anything that EncodeMotion does not write, with the reason.
MovingGaussians DecodeMotion(std::string_view bytes);

}  // namespace color3d
