// How well one view's deep features explain the other views: the score of the coverage strategy
// (STILL.md "Stage 1a"). Pure, thread-safe.
#pragma once

#include <vector>

#include "core/base/run_control.h"
#include "core/keyview/view_features.h"

namespace color3d {

// Entry i, for every kept view i: the mean over the other kept views' cells of the root mean
// squared distance to the nearest cell of view i; 0 for the others and for a single view. Features
// are standardised over all kept views and reduced to their leading principal components. Cells are
// thinned out as views become more (first those that are explained, down to a few of each view), so
// that 300 views take seconds and 2000 some ten seconds. The same numbers for any thread count.
// Throws Error{kInvalidArgument} when no view is kept, a kept view has no cells, or channel counts
// differ.
std::vector<double> MeanFeatureDistances(const std::vector<ViewFeatures>& views,
                                         const std::vector<bool>& kept,
                                         const RunControl& run);

// For key views that are chosen together: by view i and query q, the distance from the cell q to
// the nearest cell of view i, as above.
struct NearestDistances {
  std::vector<int> owner;                // view of each query; views that are not kept own none
  std::vector<double> weight;            // of each query; those of one view sum to 1
  std::vector<std::vector<float>> from;  // by view, by query; empty for views that are not kept
};
NearestDistances FindNearestDistances(const std::vector<ViewFeatures>& views,
                                      const std::vector<bool>& kept,
                                      const RunControl& run);

// How many cells of each view MeanFeatureDistances looks at, at most.
int CellsForCoverage(size_t views, int channels);

}  // namespace color3d
