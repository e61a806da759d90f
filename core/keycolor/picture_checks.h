// Checks that a picture is in colour and that two pictures show the same. For all pictures that
// users or models give as coloured key view or as other pictures of its scene. Pure functions,
// thread-safe.
#pragma once

#include <string>

#include "core/base/image.h"

namespace color3d {

// Returns the size as "640x480".
std::string SizeText(const Image& image);

struct LuminanceAgreement {
  double mean_difference = 0.0;  // mean |L1 - L2|, 0..100
  double correlation = 0.0;      // Pearson correlation; 0 if one of the two is constant
  bool both_flat = false;        // both are flat, so they agree
  // Correlation below which two pictures show different things.
  static constexpr double kMinCorrelation = 0.5;
  bool SameSubject() const { return both_flat || correlation > kMinCorrelation; }
};
// Compares the first planes (L 0..100) of two pictures of equal size at 256 px.
LuminanceAgreement CompareLuminance(const Image& first, const Image& second);

struct ChromaLevel {
  double mean = 0.0;          // Lab units
  double percentile99 = 0.0;  // Lab units
  // Tolerates the chroma that compression adds to grey pictures.
  bool IsGray() const { return mean < 1.5 && percentile99 < 4.0; }
};
// Requires: a Lab picture.
ChromaLevel MeasureChroma(const Image& lab);

// Throws Error{kInvalidArgument} starting with `what` if the first planes do not correlate.
void ExpectSameSubject(const Image& luminance, const Image& other, const char* what);
// Throws Error{kInvalidArgument} starting with `what` if a Lab picture has almost no chroma.
void ExpectColor(const Image& lab, const char* what);

}  // namespace color3d
