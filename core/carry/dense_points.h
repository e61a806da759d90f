// Dense surface points from plane sweeps: the depth of each training view, checked against other
// views. A denser start for the Gaussians than the points of structure-from-motion. Stateless; runs
// on the pool's threads.
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
  int max_views = 32;       // training views, evenly spread; all views of a time or none
  int depth_sources = 4;    // views that each view is compared with, 1..16
  int depth_side_px = 200;  // longer side of the depth maps
  PlaneSweepOptions sweep;
  int agreeing = 2;         // sources that must confirm a depth; all when there are fewer
  double tolerance = 0.01;  // relative difference of depth
  int max_points = 20'000;  // evenly thinned above that
};

// Static regions of a view: 1 channel of the view's working size, 0 on moving objects; null: not
// known. Called from several threads at once.
using StillRegions = std::function<std::shared_ptr<const Image>(int view)>;

// Returns points with the views that confirm them, ascending; no point repeats one of an earlier
// view. Held-out views are not used. Empty when no view observes a point of the scene. The training
// views of one time, where there are several, are compared with each other alone. Pixels that are
// not `still` count as masked; empty: all are. Throws Error{kCancelled}.
std::vector<SparsePoint> DensePoints(const Scene& scene,
                                     const ViewImages& images,
                                     const DensePointsOptions& options,
                                     const RunControl& run,
                                     const StillRegions& still = {});

}  // namespace color3d
