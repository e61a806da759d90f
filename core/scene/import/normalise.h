// Brings a scene's coordinates into the range that float32 and the near plane of the rasteriser
// (0.2 units) support, and refuses scenes for which that is impossible. For this folder and for
// tests.
#pragma once

#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// Typical distance of the visible surfaces, scene units: the median depth of sparse points in the
// views that observe them; without points, the mean distance of the cameras from the point that
// they look at. Throws Error{kInvalidArgument} if no observed point is in front of its camera.
double TypicalDepth(const Scene& scene);

// Leaves a scene unchanged, bit for bit, if its typical depth is 1..1000 and it lies within 1e3
// units of the origin. Otherwise scales lengths so that the typical depth becomes 10, subtracts the
// mean of the camera centres, and records both in the scene. Returns notes for the user. Throws
// Error{kInvalidArgument} as TypicalDepth, or naming the view or point that lies more than 1e9
// typical depths away from the mean of the cameras.
std::vector<std::string> NormaliseScene(Scene* scene);

// Share of observations whose sparse point lies behind the observing camera, 0..1. 0 without
// points.
double ShareBehindCameras(const Scene& scene);

}  // namespace color3d
