// Hints above the colours of another source (STILL.md "Hints above other colours"): they change the
// thing that they lie on, fade with the distance and end at its edges; elsewhere the colours below
// stay exactly. The result does not depend on the number of threads.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/image.h"
#include "core/base/run_control.h"
#include "core/keycolor/hints/hints.h"

namespace color3d {

struct LayerOptions {
  // L difference (0..100) of neighbours that halves their coupling: at least `sigma`, and in
  // textured regions `texture` times the mean difference there.
  double sigma = 0.5;    // 0.1..50
  double texture = 2.0;  // 0..20
  // Distance over which the pull of a long stroke falls to 1/e on a smooth thing, as a share of the
  // longer side, 0.005..1.
  double reach = 0.15;
  // Differences to what lies under the nearest strokes at which a place counts as unlike.
  double unlike_luminance = 8.0;  // L units, above 0
  double unlike_chroma = 10.0;    // Lab units of the colours below, above 0
  // Larger photos are solved at this size and upsampled, guided by L.
  int max_side_px = 1024;
  double tolerance = 1e-3;
  int max_iterations = 200;
  void Validate() const;
};

struct HintLayer {
  Image ab;     // 2 channels, Lab units; valid where the share is above 0
  Image share;  // 1 channel, 0..1: by how much the colours below are replaced
  int64_t hinted_pixels = 0;
  int iterations = 0;
};

// `below`: 2 channels, Lab units, size of `luminance`. Hinted pixels have the share 1 and their
// hint exactly; hints of Fill::kAutomatic keep what lies below: share 0. `pictures`: automatic_ab
// is ignored. `prepared`: of the same picture and options; null: made. Throws what
// KeyColorFromHints throws.
HintLayer LayerOfHints(const Image& luminance,
                       const Image& below,
                       const std::vector<ColorHint>& hints,
                       const LayerOptions& options,
                       const RunControl& control,
                       const HintPictures& pictures = {},
                       QuickGrid* prepared = nullptr);

// What LayerOfHints needs of the picture alone, for quick answers to changing hints, near the layer
// (quick_grid.h), whatever the tolerance. The pool must outlive it.
std::shared_ptr<QuickGrid> PrepareLayer(const Image& luminance,
                                        const LayerOptions& options,
                                        ThreadPool& pool);

// Replaces `below` by the colours of the layer, by its share.
void LayAbove(const HintLayer& layer, Image* below);

}  // namespace color3d
