// Fuses all colours that are known of a view, per pixel by confidence (STILL.md "Fusion of
// sources"): carried from a key view > inferred by the personalized colorizer > guessed by the
// automatic one. Pure functions, thread-safe.
#pragma once

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"
#include "core/carry/carry.h"
#include "core/carry/confidence.h"
#include "core/color/relative_chroma.h"

namespace color3d {

struct FusionOptions {
  // Weight of an inferred colour, times 1 - the weight of the carried one, over 1 + distance^2:
  // unfamiliar places take more colour from their surroundings. The weight of a carried colour is
  // its confidence squared (less error on three of four scenes than the confidence itself), that of
  // a neighbour of equal luminance 1.
  double inferred_weight = 0.1;
  // Carried colours below this confidence are not used, 0..1.
  double min_confidence = kMinMatchProbability;
  // Luminance difference (L units) at which neighbours half agree, as for hints.
  double edge_sigma = 1.0;
  // Feature distances (ColorPrediction::distance) where the automatic guess begins to replace the
  // inferred colour and where it has its full share.
  double guess_begins = 3.0;
  double guess_ends = 5.0;
  double max_guessed = 0.9;   // full share of the guess, 0..1
  double guess_chroma = 0.7;  // factor of the guess's chroma, 0..1
  // A colourful guess (sky, leaves) is usually right: between these feature distances and chromas
  // (Lab units) its share rises to 1, with its full chroma.
  double bold_distance_begins = 1.5;
  double bold_distance_ends = 3.0;
  double bold_chroma_begins = 15.0;
  double bold_chroma_ends = 25.0;
  // Solve the system; if not, each pixel has the weighted mean of its own sources.
  bool spread = true;
  // The system is solved for chroma relative to luminance.
  RelativeChroma relative_chroma;
  void Validate() const;
};

struct FusedColor {
  Image ab;          // 2 channels, Lab units
  Image provenance;  // planes as in ProvenancePlane
};

// The sources of one view's colour, all of the luminance's size. The references must outlive the
// call.
struct FusionSources {
  const Image& luminance;       // 1 channel, L 0..100
  const CarriedColor& carried;  // confidence 0 where nothing was carried
  const Image& inferred;        // 2 channels, Lab units
  const Image& distance;        // 1 channel, feature distance; empty: nothing is guessed
  const Image& guessed;         // 2 channels, Lab units; empty: the guess is grey
};

// Solves the screened system of core/grid/grid_solver.h on the view's own luminance, so that small
// gaps in the carried colours are filled from their surroundings. Throws Error{kInvalidArgument}
// for sizes that differ.
FusedColor FuseColors(const FusionSources& sources,
                      const FusionOptions& options,
                      ThreadPool& pool,
                      const CancellationToken& cancel);

}  // namespace color3d
