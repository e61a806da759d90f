// A frame of a film that starts at the key view, without knowing its geometry (STILL.md
// "Stage 1c"): a slow zoom and turn, and a smooth flow. Pure function, thread-safe.
#pragma once

#include <cstdint>

#include "core/augment/generated_picture.h"

namespace color3d {

// `lab`: 3 channels, Lab units. Weight 1 inside the picture, 0 where the flow looks beyond its
// border (there the border is mirrored).
GeneratedPicture FlowFrame(const Image& lab, uint64_t seed);

}  // namespace color3d
