// Points of the surfaces that several photos agree on: depth by plane sweep for each training view,
// checked against the others. A denser start for the Gaussians than structure-from-motion's points
// alone. Pure function but for the pool's threads.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "core/base/run_control.h"
#include "core/carry/plane_sweep.h"
#include "core/scene/scene.h"
#include "core/scene/view_images.h"

namespace color3d {

struct DensePointsOptions {
  int max_views = 32;       // evenly spaced ones of the training views, of whole moments
  int depth_sources = 4;    // views that each view is compared with, 1..16
  int depth_side_px = 200;  // at which depth is measured
  PlaneSweepOptions sweep;
  int agreeing = 2;         // of the sources, for a depth to count; or all when fewer
  double tolerance = 0.01;  // relative difference of depth
  int max_points = 20'000;  // evenly thinned above that
};

// Points carry the views that agree, ascending; none is one that an earlier view gave already.
// Held-out views are not looked at. No points where no view is known to observe any of the scene's
// own. Where a moment has several training views, they are compared with each other alone: at
// other moments things may be elsewhere. `still` (empty, or null for a view: not known): 1 channel
// of the view's working size, 0 where something moves on its own, which counts as masked. Called
// from several threads at once. Throws Error{kCancelled}.
using StillRegions = std::function<std::shared_ptr<const Image>(int view)>;
std::vector<SparsePoint> DensePoints(const Scene& scene,
                                     const ViewImages& images,
                                     const DensePointsOptions& options,
                                     const RunControl& run,
                                     const StillRegions& still = {});

}  // namespace color3d
