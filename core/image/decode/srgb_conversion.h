// Conversion of pictures in other colour spaces to sRGB (Little CMS inside, never in this
// interface). Pure functions, thread-safe.
#pragma once

#include <string>

#include "core/base/image.h"
#include "core/image/probe/color_tag.h"

namespace color3d {

// Converts an image that was stored with `bits` (8 or 16) a channel to sRGB, relative to white and
// with black kept black; alpha is unchanged. A grey image (1 or 2 channels) stays grey and gets the
// tones of sRGB. Colours outside sRGB are clipped to 0..1. Images that equal sRGB within a rounding
// of 8 bits are unchanged. Returns the reason if the tag was not followed, as the continuation of
// "is read as sRGB: "; else empty.
std::string ConvertToSrgb(const ColorTag& tag, int bits, Image* image);

// The value that ConvertToSrgb would return for a picture of this tag.
std::string ColorTagProblem(const ColorTag& tag);

// ICC profiles of sRGB and of grey with sRGB's tones; the bytes are constant.
const std::string& SrgbProfile();
const std::string& SrgbGrayProfile();

}  // namespace color3d
