// Thresholds and encodings of how sure a colour is, shared by all that carry, fuse and show
// colours.
//
// Match probability: probability that a pixel of the source shows the surface of a pixel of the
// target, 0..1 (carry.cc). It is stored as the confidence of the carried colour.
// Shown confidence: derived from provenance; viewers and exports call it "confidence".
#pragma once

#include <algorithm>

namespace color3d {

// Match probability below which pixels are not compared and carried colours are not used.
inline constexpr double kMinMatchProbability = 0.05;
// Confidence above which a pixel counts as covered by carried colour in coverage figures.
inline constexpr float kCoveredConfidence = 0.25f;
// Confidence below which a carried colour does not train the colorizer.
inline constexpr float kTrainingConfidence = 0.3f;
// Confidence above which a carried colour or an optical flow track decides alone.
inline constexpr float kDecisiveConfidence = 0.5f;

// Channels of a provenance image: shares 0..1 of a pixel's colour, which sum to 1.
enum ProvenancePlane : int {
  kGuessedPlane = 0,   // by the automatic colorizer
  kSeenPlane = 1,      // carried from a key view
  kInferredPlane = 2,  // by the scene's colorizer
};
inline constexpr int kProvenancePlanes = 3;

// Shown confidence of a pixel, 0..1: a seen colour counts in full, an inferred one by half.
inline float ShownConfidence(float seen, float inferred) {
  return std::min(1.0f, seen + 0.5f * inferred);
}

}  // namespace color3d
