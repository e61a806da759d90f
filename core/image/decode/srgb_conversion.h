// Pictures in other colour spaces, turned to sRGB as their files say (Little CMS inside, never in
// this interface). Pure functions, thread-safe.
#pragma once

#include <string>

#include "core/base/image.h"
#include "core/image/probe/color_tag.h"

namespace color3d {

// Turns the colours of an image that was stored with `bits` (8 or 16) a channel to sRGB, relative
// to white and with black kept black; alpha stays. A grey image (1 or 2 channels) stays grey: its
// tones become those of sRGB. Colours that sRGB does not hold are cut to 0..1. What is sRGB up to
// a rounding of 8 bits is left as it is. Returns why the tag was not followed, in words to put
// behind "is read as sRGB: "; else empty.
std::string ConvertToSrgb(const ColorTag& tag, int bits, Image* image);

// What ConvertToSrgb would return for a picture of this tag.
std::string ColorTagProblem(const ColorTag& tag);

// An ICC profile of sRGB, and one of sRGB's tones in grey; always the same bytes.
const std::string& SrgbProfile();
const std::string& SrgbGrayProfile();

}  // namespace color3d
