// Detects photos taken from a single place by their local features, before structure-from-motion
// starts: if the camera only rotates, there is no depth. Pure functions, thread-safe. For this
// folder only.
#pragma once

#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/image/local_features.h"

namespace color3d {

// Motion between two photos, measured from shared features.
struct PairMotion {
  int matches = 0;
  double turned = 0.0;        // share of the matches explained by a rotation of the camera, 0..1
  double median_shift = 0.0;  // of the matches, as a share of the photos' longer side
};

// Fits a pure rotation and a focal length by random samples of two matches (deterministic). Matches
// within 0.4 % of the longer side count as inliers.
PairMotion MeasureMotion(const LocalFeatures& a, const LocalFeatures& b);

struct ParallaxEvidence {
  int photos = 0;             // compared
  int pairs = 0;              // compared, spread evenly over all pairs
  int matched = 0;            // with enough matches to judge
  int turned = 0;             // of those, explained by a rotation
  int largest_place = 0;      // photos in the largest group connected by such pairs
  double median_shift = 0.0;  // over the matched pairs, as a share of the longer side

  // True if nearly all overlapping pairs are explained by rotation, and they include nearly all
  // photos. False if too few pairs can be judged.
  bool IsFromOnePlace() const;
};

ParallaxEvidence MeasureParallax(const std::vector<LocalFeatures>& photos,
                                 ThreadPool& pool,
                                 const CancellationToken& cancel);

// "310 of 320 overlapping pairs of photos ...", without a full stop.
std::string Describe(const ParallaxEvidence& evidence);

}  // namespace color3d
