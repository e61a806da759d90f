// Renders the key view from another camera by its depth map (STILL.md "Stage 1c"): a z-buffered
// forward warp of the visible surface. Pure functions, thread-safe.
#pragma once

#include "core/augment/generated_picture.h"
#include "core/scene/camera.h"

namespace color3d {

struct DepthView {
  Image lab;    // 3 channels, Lab units
  Image depth;  // 1 channel, same size: camera depth, > 0; 0 where unknown
  Camera camera;
  Pose cam_from_world;
};

// Rendering of the geometry from the new camera. Fills regions that the key view does not see.
struct TargetGeometry {
  Image luminance;  // 1 channel, L
  Image depth;      // as in DepthView
};

// Renders from a camera with the same intrinsics at `target_from_world`. The surface is cut at
// depth discontinuities, so that nothing is stretched across an edge. Pixels occluded by surfaces
// that only the target sees stay open. Open pixels have weight 0; their L is that of `geometry`
// where it is known, else filled smoothly. `geometry` may have empty images.
GeneratedPicture WarpToView(const DepthView& key,
                            const Pose& target_from_world,
                            const TargetGeometry& geometry);

}  // namespace color3d
