// Where a scene moves: what Gaussians that stand still cannot explain (DYNAMIC.md "Motion").
// Internal to the splat module. Deterministic whatever the thread count.
#pragma once

#include <functional>
#include <vector>

#include "core/base/image.h"
#include "core/base/parallel.h"
#include "core/splat/training/posed_camera.h"

namespace color3d {

// Small pictures of one training view, all of the size of `camera`. Values 0..1 are L / 100.
struct SurveyedView {
  PosedCamera posed;  // with the small camera
  Image luminance;    // 1 channel, 0..1
  Image drawn;        // 1 channel, 0..1: by what stands still
  Image depth;        // 1 channel, world units; 0: nothing is there
  Image still;        // 1 channel: 0 where something was seen to move on its own; empty: not known
  Image moving;       // 1 channel, 0 or 1; set by SurveyMotion
};

// Longer side of a surveyed picture, at most.
inline constexpr int kSurveySidePx = 192;

struct MotionSurvey {
  double moving_share = 0.0;    // motion energy: of all pixels, those that move
  double residual_share = 0.0;  // of all pixels, those whose residual says so
  double threshold = 0.0;       // of |residual| over 5x5 px, 0..1
  double least_share = 0.0;     // a smaller residual_share is what still scenes have, too
};

// Sets `moving` of every view: where the mean residual over 5x5 px is beyond five deviations of the
// scene's (and 0.03). From the residuals of a camera that does not move the median over time is
// taken away first: that is what stands still and is drawn badly; where no camera stands still and
// nothing that was seen beforehand is confirmed, more is asked (`least_share`). Specks are none.
// What `still` leaves out moves, too, where at least a tenth of all of it has such residuals. With
// one time for all views nothing moves.
MotionSurvey SurveyMotion(ThreadPool& pool, std::vector<SurveyedView>& views);

}  // namespace color3d
