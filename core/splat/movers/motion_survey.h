// Detection of motion as residuals that static Gaussians cannot explain (DYNAMIC.md "Motion").
// Internal to the splat module. Deterministic for every thread count.
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
  Image drawn;        // 1 channel, 0..1: render of the static part
  Image depth;        // 1 channel, world units; 0: empty
  Image still;        // 1 channel: 0 where motion was detected before; empty: unknown
  Image moving;       // 1 channel, 0 or 1; set by SurveyMotion
};

// Maximum longer side of a surveyed picture.
inline constexpr int kSurveySidePx = 192;

struct MotionSurvey {
  double moving_share = 0.0;    // motion energy: share of moving pixels
  double residual_share = 0.0;  // share of pixels whose residual exceeds the threshold
  double threshold = 0.0;       // of |residual| over 5x5 px, 0..1
  double least_share = 0.0;     // smaller values of residual_share occur in static scenes, too
};

// Sets `moving` of every view: the pixels whose mean residual over 5x5 px exceeds five standard
// deviations of the scene's residuals (and 0.03). For a static camera the median residual over time
// is subtracted first, because a constant residual is a badly drawn static region. Without a static
// camera and without confirmation of earlier detections the evidence must be stronger
// (`least_share`). Removes specks. The pixels excluded by `still` move, too, if at least a tenth of
// them have such residuals. With one time for all views nothing moves.
MotionSurvey SurveyMotion(ThreadPool& pool, std::vector<SurveyedView>& views);

}  // namespace color3d
