// Splits a Lab picture into L and ab; JoinLab (lab.h) is the inverse. Pure, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d {

// L (1 channel) and ab (2 channels) of a 3-channel Lab picture. Throw Error{kInvalidArgument} on
// another channel count.
Image LuminanceOfLab(const Image& lab);
Image ChromaOfLab(const Image& lab);

}  // namespace color3d
