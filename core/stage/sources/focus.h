// The point that a view looks at, the center of orbits. Stateless.
#pragma once

#include <Eigen/Core>

#include "core/base/image.h"
#include "core/scene/scene.h"

namespace color3d {

// Returns the point on the camera's axis at the median depth of the middle of the picture; at depth
// 1 where there is none. `depth`: 1 channel of the size of `camera`, 0: no surface
// (RenderedView::median_depth).
Eigen::Vector3d FocusOf(const View& view, const Camera& camera, const Image& depth);

}  // namespace color3d
