// Brings a scene's coordinates into the range that float32 and the rasteriser's near plane (0.2
// units) can bear, and refuses those that no range can. For this folder and for tests.
#pragma once

#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// Typical distance of what the cameras see: the median depth of the sparse points in the views that
// observe them, or without points the mean distance of the cameras from the place that they look
// at. Scene units. Throws Error{kInvalidArgument} when no observed point is in front of its camera.
double TypicalDepth(const Scene& scene);

// Leaves a scene alone, bit for bit, whose typical depth is 1..1000 and which lies within 1e3 units
// of the origin. Otherwise divides lengths so that the typical depth becomes 10, subtracts the mean
// of the cameras' centres, and notes both in the scene. Returns what to tell the user. Throws
// Error{kInvalidArgument}: as TypicalDepth, or naming the view or point that lies more than 1e9
// typical depths away from the cameras' mean.
std::vector<std::string> NormaliseScene(Scene* scene);

// How many observations of sparse points lie behind the observing camera, 0..1. 0 without points.
double ShareBehindCameras(const Scene& scene);

}  // namespace color3d
