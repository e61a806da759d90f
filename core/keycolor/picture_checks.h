// Is a picture in colour, and does it show what another one shows? Asked of everything that a user
// or a model gives as the coloured key view or as more pictures of its scene. Pure functions,
// thread-safe.
#pragma once

#include <string>

#include "core/base/image.h"

namespace color3d {

// "640x480".
std::string SizeText(const Image& image);

struct LuminanceAgreement {
  double mean_difference = 0.0;  // mean |L1 - L2|, 0..100
  double correlation = 0.0;      // Pearson; 0 when one of the two is constant
  bool both_flat = false;        // neither shows anything, so they agree
  // Below this two pictures show different things.
  static constexpr double kMinCorrelation = 0.5;
  bool SameSubject() const { return both_flat || correlation > kMinCorrelation; }
};
// The first planes (L 0..100) of two pictures of equal size, compared at 256 px.
LuminanceAgreement CompareLuminance(const Image& first, const Image& second);

struct ChromaLevel {
  double mean = 0.0;          // Lab units
  double percentile99 = 0.0;  // Lab units
  // Compression alone makes a little chroma of grey.
  bool IsGray() const { return mean < 1.5 && percentile99 < 4.0; }
};
// Of a Lab picture.
ChromaLevel MeasureChroma(const Image& lab);

// Throws Error{kInvalidArgument} starting with `what` when the first planes do not correlate.
void ExpectSameSubject(const Image& luminance, const Image& other, const char* what);
// Throws Error{kInvalidArgument} starting with `what` when a Lab picture has hardly any chroma.
void ExpectColor(const Image& lab, const char* what);

}  // namespace color3d
