// Colours of the key view from exemplars: another photo of the place, a postcard, another view.
#pragma once

#include <vector>

#include "core/base/image.h"
#include "core/base/run_control.h"
#include "core/encoder/encoder.h"

namespace color3d {

struct ReferenceOptions {
  int match_side_px = 448;    // longer side at which pictures are compared, 64..1024
  int spread_side_px = 1024;  // longer side at which matches are spread, 64..8192
  int bank_size = 12000;      // maximum number of cells of all references, 100..100000
  int neighbors = 8;          // matches to blend, 1..64
  double sigma = 0.5;         // as in HintOptions
  double match_weight =
      0.1;  // weight of a certain match relative to an edge of a flat region (1), > 0
  double low_confidence = 0.1;  // mean confidence below which chroma is faded with a warning
  unsigned seed = 1;            // chooses the cells of the bank
  void Validate() const;
};

struct ReferenceSolution {
  Image ab;  // 2 channels, Lab units, size of `luminance`
  Image
      confidence;  // 1 channel, 0..1, size of `luminance`: confidence of matches before propagation
  // Share of each reference in the confidence of the key view; sums to 1, or all 0.
  std::vector<double> explained;
  double mean_confidence = 0.0;
  int iterations = 0;
  double relative_residual = 0.0;
};

// `luminance` 1 channel, L 0..100; `references_srgb` 3 channels sRGB 0..1 each, any sizes from 16
// px. Cells of 4 px are matched by whitened encoder features (with fixed shares of the distance)
// and local luminance statistics of the references, histogram-matched to the key view; the best
// matches are blended. Confidence is high where the match is as close as cells within a reference
// are to one another, is mutual, and its candidates agree on the colour. Matches are then
// propagated along the luminance like soft hints. Throws Error{kInvalidArgument} naming a reference
// that has no colour or is too small. Warns, with the mean confidence, if the references are
// unrelated. The result does not depend on the number of threads.
ReferenceSolution KeyColorFromReferences(const Image& luminance,
                                         const std::vector<Image>& references_srgb,
                                         const Encoder& encoder,
                                         const ReferenceOptions& options,
                                         const RunControl& control);

}  // namespace color3d
