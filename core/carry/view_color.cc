#include "core/carry/view_color.h"

#include <algorithm>

#include "core/carry/confidence.h"

namespace color3d {
namespace {

constexpr double kWorthGuessing = 0.02;  // share of a view's pixels

// Returns whether enough of the view is far from the training pictures and has no carried colour.
bool NeedsGuess(const CarriedColor& carried, const Image& distance, const FusionOptions& options) {
  size_t strange = 0;
  for (size_t i = 0; i < distance.data.size(); ++i) {
    strange += distance.data[i] > std::min(options.guess_begins, options.bold_distance_begins) &&
                       carried.confidence.data[i] <= options.min_confidence
                   ? 1
                   : 0;
  }
  return static_cast<double>(strange) >
         kWorthGuessing * static_cast<double>(carried.confidence.PlaneSize());
}

// Returns 1 where the carried colour decides alone.
Image DecisivelyCarried(const CarriedColor& carried) {
  Image decisive = carried.confidence;
  for (float& value : decisive.data) value = value > kDecisiveConfidence ? 1.0f : 0.0f;
  return decisive;
}

// The colorizer infers no colour for known pixels: their carried colour takes its place, so that
// nothing pulls them elsewhere.
void CopyKnown(const CarriedColor& carried, const Image& known, Image* inferred_ab) {
  for (size_t i = 0; i < known.data.size(); ++i) {
    if (known.data[i] == 0.0f) continue;
    for (int c = 0; c < 2; ++c) inferred_ab->Plane(c)[i] = carried.ab.Plane(c)[i];
  }
}

}  // namespace

FusedColor FuseViewColor(const Image& luminance,
                         const CarriedColor& carried,
                         const ColorSources& sources,
                         ThreadPool& pool,
                         const CancellationToken& cancel) {
  FusionOptions options;
  options.relative_chroma = sources.relative_chroma;
  options.spread = sources.spread;
  const Image known = DecisivelyCarried(carried);
  InferredColor inferred = sources.infer(luminance, known);
  CopyKnown(carried, known, &inferred.ab);
  const bool guess = NeedsGuess(carried, inferred.distance, options);
  const Image guessed = guess ? sources.guess(luminance) : Image();
  return FuseColors(
      {luminance, carried, inferred.ab, inferred.distance, guessed}, options, pool, cancel);
}

}  // namespace color3d
