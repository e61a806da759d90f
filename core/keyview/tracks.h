// How much of what the other views show a view sees too, from the tracks of structure-from-motion:
// the score of the `tracks` strategy (STILL.md "Stage 1a"). Pure, thread-safe.
#pragma once

#include <string>
#include <vector>

namespace color3d {

// tracks[p]: the views (indices, ascending) that see point p. Entry i, for every kept view i: the
// mean over the other kept views j of sqrt(share of j's points that i sees too). The root makes a
// view that shares something with all others (a central one) beat one that shares everything with
// its neighbours only. 0 for the others. Tracks of unkept views do not count. Throws
// Error{kInvalidArgument} for an index that is no view.
std::vector<double> TrackCoverage(const std::vector<std::vector<int>>& tracks,
                                  const std::vector<bool>& kept);

// Why these tracks cannot tell views apart, empty when they can: too few points in too many views.
std::string WhyTracksAreNoUse(const std::vector<std::vector<int>>& tracks,
                              const std::vector<bool>& kept);

}  // namespace color3d
