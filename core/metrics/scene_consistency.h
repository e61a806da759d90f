// ME and TC of a whole scene (METHOD.md "Metrics"): which pairs of views are compared, and how
// their pictures are fetched without keeping more than a few in memory.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/metrics/consistency.h"

namespace color3d {

// Pictures are compared at no more than this longer side.
inline constexpr int kConsistencySidePx = 500;

// Where the pictures of a scene's views come from; all of a view have one size.
struct ConsistencySource {
  struct Rendered {
    PosedDepth geometry;
    Image lab;  // 3 channels
  };

  // Which views are compared (ConsistencyPairs): how many there are of each group, numbered on from
  // group to group.
  std::vector<int> groups;
  // The coloured model as a view sees it. Called for one view at a time: it may use the pool.
  std::function<Rendered(int view)> render;
  // The photo with the colours that were predicted for it, 3 channels of Lab. Called from several
  // threads at once.
  std::function<Image(int view)> colored_lab;
  // The photo in its true colours, 3 channels of sRGB, where has_truth says so. As colored_lab.
  std::function<bool(int view)> has_truth;
  std::function<Image(int view)> true_srgb;
};

struct SceneConsistency {
  Consistency rendered;              // pictures of the coloured model
  Consistency colored;               // the photos in their predicted colours
  std::optional<Consistency> truth;  // the true colours: what the photos themselves leave
};

// Over ConsistencyPairs of all groups, training and held-out ones alike; matches come from the
// model's own depth. The truth is scored when every view of the pairs has one. Throws
// Error{kCancelled} and what the source throws.
SceneConsistency MeasureConsistency(const ConsistencySource& source,
                                    ThreadPool& pool,
                                    const CancellationToken& cancel);

}  // namespace color3d
