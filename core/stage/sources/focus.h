// What a view looks at: what one turns around. Stateless.
#pragma once

#include <Eigen/Core>

#include "core/base/image.h"
#include "core/scene/scene.h"

namespace color3d {

// The median of the depths in the middle of the view's picture, on the camera's axis; a unit away
// where nothing is drawn. `depth`: 1 channel, of the size of `camera`, 0: nothing
// (RenderedView::median_depth).
Eigen::Vector3d FocusOf(const View& view, const Camera& camera, const Image& depth);

}  // namespace color3d
