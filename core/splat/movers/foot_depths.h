// Depth of moving objects that no other camera sees, assuming that objects stand on the ground.
// Internal to the splat module.
#pragma once

#include <vector>

#include "core/base/parallel.h"
#include "core/splat/movers/motion_survey.h"

namespace color3d {

// For each view and pixel, the depth of the static surface at the lowest pixel of its moving region
// (without such a surface, the view's median depth); 0 outside moving regions. For a static camera,
// regions above each other form one object, and an object's depth is the median over 17 frames:
// depths that jump back and forth would appear twice from the side. Deterministic.
std::vector<Image> FootDepths(const std::vector<SurveyedView>& views, ThreadPool& pool);

// Median over the pixels with a depth; 0 without any.
double MedianDepth(const SurveyedView& view);

}  // namespace color3d
