// Score of the coverage strategy (STILL.md "Stage 1a"): how well the deep features of one view
// explain the other views. Pure functions, thread-safe.
#pragma once

#include <vector>

#include "core/base/run_control.h"
#include "core/keyview/view_features.h"

namespace color3d {

// Returns for every kept view i the mean, over the cells of the other kept views, of the root mean
// squared distance to the nearest cell of view i; 0 for other views and for a single view. Features
// are standardised over all kept views and reduced to their leading principal components. Cells are
// subsampled for many views (queries first, down to a few per view), so that 300 views take seconds
// and 2000 about ten seconds. The result does not depend on the number of threads. Throws
// Error{kInvalidArgument} if no view is kept, a kept view has no cells, or channel counts differ.
std::vector<double> MeanFeatureDistances(const std::vector<ViewFeatures>& views,
                                         const std::vector<bool>& kept,
                                         const RunControl& run);

// Distance from each query cell q to the nearest cell of each view i, as above, for joint selection
// of key views.
struct NearestDistances {
  std::vector<int> owner;                // view of each query; only kept views have queries
  std::vector<double> weight;            // weight of each query; sums to 1 per view
  std::vector<std::vector<float>> from;  // by view and query; empty for views that are not kept
};
NearestDistances FindNearestDistances(const std::vector<ViewFeatures>& views,
                                      const std::vector<bool>& kept,
                                      const RunControl& run);

// Maximum number of cells per view that MeanFeatureDistances uses.
int CellsForCoverage(size_t views, int channels);

}  // namespace color3d
