// The key view as another camera would see it, through its depth map (STILL.md "Stage 1c"): a
// z-buffered forward warp of the surface that the key view sees. Pure functions, thread-safe.
#pragma once

#include "core/augment/generated_picture.h"
#include "core/scene/camera.h"

namespace color3d {

struct DepthView {
  Image lab;    // 3 channels, Lab units
  Image depth;  // 1 channel, same size: camera depth, > 0; 0 where nothing is known
  Camera camera;
  Pose cam_from_world;
};

// What the geometry alone shows from the new camera; fills what the key view does not see.
struct TargetGeometry {
  Image luminance;  // 1 channel, L
  Image depth;      // as in DepthView
};

// From a camera with the same intrinsics at `target_from_world`. The surface is cut where depth
// jumps, so that nothing is stretched across an edge; what lies behind something that only the
// target sees is left open. Open pixels have weight 0: their L is that of `geometry` where it has
// some, the rest continues smoothly. `geometry` may have empty images: then all of it continues.
GeneratedPicture WarpToView(const DepthView& key,
                            const Pose& target_from_world,
                            const TargetGeometry& geometry);

}  // namespace color3d
