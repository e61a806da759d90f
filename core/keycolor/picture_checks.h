// What a coloured picture must have to be of use: the same subject, colour. Internal to
// core/keycolor.
#pragma once

#include "core/base/image.h"

namespace color3d {

// Compares the first planes (L 0..100) of two pictures of equal size. Throws
// Error{kInvalidArgument} starting with `what` when they do not correlate.
void ExpectSameSubject(const Image& luminance, const Image& other, const char* what);
// Throws Error{kInvalidArgument} starting with `what` when a Lab picture has hardly any chroma.
void ExpectColor(const Image& lab, const char* what);

}  // namespace color3d
