// Propagates colours from view to view by optical flow, as video colourization does (METHOD.md
// "Baselines"). Pure functions, thread-safe.
#pragma once

#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/carry/carry.h"
#include "core/scene/scene.h"

namespace color3d {

struct PropagationPlan {
  std::vector<int> source;  // of each view: the view that it takes its colours from; -1: none
  // Views by their number of steps from a key view, ascending within a level. The first level has
  // the key views.
  std::vector<std::vector<int>> levels;
  std::vector<int> unconnected;  // views that no path reaches, ascending
};

// Plans paths of least cost from the key views to all other ones. The cost of a step between two
// photos is -ln of their overlap: the points that both observe over the geometric mean of those
// that each observes. A held-out photo is the end of a path. `along_shots`: frames step to the next
// and the previous frame of their shot, at little cost, and to overlapping frames of other cameras
// of the same time. Requires: with `along_shots`, all views have a moment.
PropagationPlan PlanPropagation(const Scene& scene,
                                const std::vector<int>& key_views,
                                bool along_shots);

// Returns the colours of a view at the places that optical flow finds in it for the pixels of
// another view. Where the flow there and back disagrees, colours spread from around, between the
// edges of `target`, and fade; the confidence is 0. `luminance`: 1 channel, L 0..100, of the size
// of `color`; if `target`, 1 channel, has another size, the source is resized to it. Throws
// Error{kCancelled}.
CarriedColor PropagateByFlow(const CarriedColor& color,
                             const Image& luminance,
                             const Image& target,
                             const CancellationToken& cancel);

}  // namespace color3d
