// Chroma relative to luminance: how a surface's chroma falls off in its shadows. Plain value, pure
// functions, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d {

// A surface under less light keeps its hue and loses chroma as a power of L: C ~ (L + 16)^power
// (CIE Lab's cube root would make the power 1 where light alone changes; haze and gloss lower it).
struct RelativeChroma {
  double power = 0.0;  // 0: chroma does not depend on L

  // Chroma at luminance L (0..100) over that at L = 50.
  float Scale(float luminance) const;
};

// ab (2 channels, Lab units) divided by, or multiplied with, the scale at each pixel's L (1 channel
// of the same size).
Image ToRelative(const RelativeChroma& relative, const Image& luminance, Image ab);
Image FromRelative(const RelativeChroma& relative, const Image& luminance, Image ab);

// Estimates the power within small windows of one coloured picture, where most changes of L are due
// to light: slope of log chroma over log (L + 16), regularized to 0.5 where the picture has little
// contrast; 0..1.
RelativeChroma FitRelativeChroma(const Image& luminance, const Image& ab);

}  // namespace color3d
