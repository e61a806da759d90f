// The parts of a Lab picture; JoinLab (lab.h) puts them together again. Pure, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d {

// L (1 channel) and ab (2 channels) of a 3-channel Lab picture. Throw Error{kInvalidArgument} on
// another channel count.
Image LuminanceOfLab(const Image& lab);
Image ChromaOfLab(const Image& lab);

}  // namespace color3d
