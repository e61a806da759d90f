// Whether photos were taken from different places, judged from their local features before
// structure-from-motion starts: where nothing but the camera's direction changes, no depth can
// follow. Pure functions, thread-safe. For this folder only.
#pragma once

#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/image/local_features.h"

namespace color3d {

// Two photos as seen through the features that they share.
struct PairMotion {
  int matches = 0;
  double turned = 0.0;        // share of the matches that a turn of the camera explains, 0..1
  double median_shift = 0.0;  // of the matches, as a share of the photos' longer side
};

// A turn: one rotation and one focal length, by random samples of two matches, always the same.
// Matches count as explained within 0.4 % of the longer side.
PairMotion MeasureMotion(const LocalFeatures& a, const LocalFeatures& b);

struct ParallaxEvidence {
  int photos = 0;             // looked at
  int pairs = 0;              // looked at, spread evenly over all pairs
  int matched = 0;            // with enough matches to tell
  int turned = 0;             // of those, a turn explains nearly everything
  int largest_place = 0;      // photos that turned pairs tie together, in the largest group
  double median_shift = 0.0;  // over the matched pairs, as a share of the longer side

  // Nearly all pairs that show the same show it from the same place, and nearly all photos are of
  // that place. False when too few pairs can be told.
  bool IsFromOnePlace() const;
};

ParallaxEvidence LookForParallax(const std::vector<LocalFeatures>& photos,
                                 ThreadPool& pool,
                                 const CancellationToken& cancel);

// "in 97 % of 320 pairs of photos ...", without a full stop.
std::string Describe(const ParallaxEvidence& evidence);

}  // namespace color3d
