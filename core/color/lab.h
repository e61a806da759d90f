// sRGB <-> CIE Lab, D65 / 2 degrees (STILL.md "Colour"). Pure functions, thread-safe.
// sRGB values are 0..1 (gamma-encoded); L is 0..100, a and b are Lab units (sRGB spans about
// a -86..98, b -108..95). Image conversions agree with the float64 functions to 1e-4 in Lab.
#pragma once

#include <array>

#include "core/base/image.h"

namespace color3d {

class ThreadPool;

struct LabColor {
  double l = 0.0;
  double a = 0.0;
  double b = 0.0;
};
struct RgbColor {
  double r = 0.0;
  double g = 0.0;
  double b = 0.0;
};

// float64 reference.
LabColor LabFromSrgb(const RgbColor& srgb);
// Out-of-gamut values are returned unclamped, outside 0..1.
RgbColor SrgbFromLabUnclamped(const LabColor& lab);
// In 0..1: chroma is reduced at constant L and hue until the colour fits, continuously in `lab`.
// Channels are not clipped, but for up to 1.3 % of red at L 90..100: the gamut's bright yellow edge
// is not convex, and there clipping costs at most 0.84 CIEDE2000 where strict reduction would halve
// the chroma of colours just outside of the gamut. L outside 0..100 becomes black or white.
RgbColor SrgbFromLab(const LabColor& lab);

// L* of a gamma-encoded grey value in 0..1, and back.
double LuminanceFromGray(double gray);
double GrayFromLuminance(double luminance);

// Whole images. 3 channels sRGB -> 3 channels Lab; 1 channel grey -> 1 channel L (0..100).
// Throws Error{kInvalidArgument} on another channel count.
Image LabFromSrgb(const Image& srgb);
Image LuminanceFromSrgb(const Image& srgb_or_gray);
// 3-channel Lab (or 1-channel L) -> 3-channel sRGB in 0..1, gamut-mapped as above.
Image SrgbFromLab(const Image& lab);
// The same on all threads of `pool`.
Image SrgbFromLab(const Image& lab, ThreadPool& pool);
// Joins L (1 channel) and ab (2 channels) of equal size to Lab (3 channels).
Image JoinLab(const Image& luminance, const Image& ab);

// Normalised values for splats: L' = L/100, a' = (a+128)/255, b' = (b+128)/255. Neutral chroma is
// therefore 128/255, not 0.5 and not 0.
inline constexpr float kNeutralChroma = 128.0f / 255.0f;

}  // namespace color3d
