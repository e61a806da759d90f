// Score of the `tracks` strategy (STILL.md "Stage 1a"): overlap of a view with the other views,
// from tracks of structure-from-motion. Pure functions, thread-safe.
#pragma once

#include <string>
#include <vector>

namespace color3d {

// tracks[p]: views (indices, ascending) that see point p. Returns for every kept view i the mean
// over the other kept views j of sqrt(share of j's points that i sees too), and 0 for other views.
// The root favours a central view, which shares some points with all others, over one that shares
// all points with its neighbours only. Views that are not kept do not count. Throws
// Error{kInvalidArgument} for an index that is not a view.
std::vector<double> TrackCoverage(const std::vector<std::vector<int>>& tracks,
                                  const std::vector<bool>& kept);

// Returns the reason why tracks are unusable (too few points in too many views), or an empty
// string.
std::string UnusableTracksReason(const std::vector<std::vector<int>>& tracks,
                                 const std::vector<bool>& kept);

}  // namespace color3d
