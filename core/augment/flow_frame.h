// Synthetic frame of a film that starts at the key view, without geometry (STILL.md "Stage 1c"): a
// slow zoom and rotation, and a smooth flow. Pure function, thread-safe.
#pragma once

#include <cstdint>

#include "core/augment/generated_picture.h"

namespace color3d {

// `lab`: 3 channels, Lab units. The weight is 1 inside the picture and 0 where the flow leaves it,
// where the picture is mirrored.
GeneratedPicture FlowFrame(const Image& lab, uint64_t seed);

}  // namespace color3d
