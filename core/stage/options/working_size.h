// Longer side of the pictures that a stage works on.
#pragma once

namespace color3d {

// Throws Error{kInvalidArgument} unless a working size is 64..4096 px.
void CheckMaxSide(int max_side_px);

}  // namespace color3d
