// How far away what moves is where no other camera tells: things stand on the ground. Internal to
// the splat module.
#pragma once

#include <vector>

#include "core/base/parallel.h"
#include "core/splat/geometry/motion_survey.h"

namespace color3d {

// Of each view, per pixel, the depth of the standing surface at the lowest pixel of its moving
// region (where there is none, the view's median depth); 0 where nothing moves. Of one camera that
// stands still, regions one above the other are one thing, and a thing's depth is the median over
// 17 of its frames: what jumps to and fro in depth would be seen twice from beside. Deterministic.
std::vector<Image> FootDepths(const std::vector<SurveyedView>& views, ThreadPool& pool);

// Of the pixels that have one; 0 where none has.
double MedianDepth(const SurveyedView& view);

}  // namespace color3d
