// Colour difference and colourfulness (METHOD.md "Metrics"). Pure functions, thread-safe.
#pragma once

#include "core/color/lab.h"

namespace color3d {

// CIEDE2000 with kL = kC = kH = 1 (Sharma, Wu, Dalal 2005; checked against their 34 pairs).
double DeltaE00(const LabColor& x, const LabColor& y);

// Mean CIEDE2000 over two 3-channel Lab images of equal size.
double MeanDeltaE00(const Image& lab_x, const Image& lab_y);

// Hasler & Suesstrunk 2003, signed opponent channels, of a 3-channel sRGB image in 0..1 (the
// formula works on 0..255).
double Colorfulness(const Image& srgb);

// The same of the magnitudes of the opponent channels, as common colourizers compute it: lower, and
// blind to the sign, so that a picture of two complementary hues scores as one of a single hue.
double AbsoluteColorfulness(const Image& srgb);

}  // namespace color3d
