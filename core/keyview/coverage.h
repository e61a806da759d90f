// How well one view's deep features explain another's: the input of the coverage strategy
// (METHOD.md "Stage 1a"). Pure, thread-safe.
#pragma once

#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/progress.h"

namespace color3d {

// deep_features[i]: view i's features on a coarse grid (Encoder::DeepFeatures), equal channel
// counts, any grid sizes. Returns d with d[i][j] = mean over the grid cells of view j of the root
// mean squared distance to the nearest cell of view i; features are standardised over all views and
// reduced to their leading principal components first, and cells are thinned out evenly, so that
// some hundred views take seconds. d[i][i] = 0. Values that are not finite count as 0. Throws
// Error{kInvalidArgument} when there is no view, a view has no cells, or channel counts differ.
std::vector<std::vector<double>> FeatureDistances(const std::vector<Image>& deep_features,
                                                  ProgressObserver& progress,
                                                  const CancellationToken& cancel);

}  // namespace color3d
