// Loss that trains features for exemplar matching (Vondrick et al. 2018, "Tracking emerges by
// colorizing videos"): cells of one view copy colours from the most similar cells of another, as in
// core/matching, and are compared with their true colours. Torch in the interface. Pure functions,
// thread-safe.
#pragma once

#include <torch/types.h>

#include <vector>

#include "core/base/random.h"
#include "core/encoder/convnext/convnext_config.h"
#include "core/matching/cell_matches.h"
#include "core/matching/whitening.h"

namespace color3d {

struct CopyLossOptions {
  int queries = 256;  // cells of the second view, sampled at random
  WhiteningOptions whitening;
  // Twice the temperature of core/matching, so that gradients reach more than the nearest cells.
  VoteOptions vote{.temperature = 0.2, .distance_floor = 0.1};
  double match_sigma_px = 6.0;  // tolerance for the distance to the true place
};

// The space of core/matching's Whitening with gradients, except through the principal directions.
// `samples` [n, C] and `cells` [m, C] of one block: [m, dims], a mean over dims of squared
// differences times `share`.
torch::Tensor WhitenBlock(const torch::Tensor& samples,
                          const torch::Tensor& cells,
                          int dims,
                          double share);

struct CopyView {
  std::vector<torch::Tensor> taps;  // [1,C,h,w], fine to coarse
  torch::Tensor luminance;          // [1,1,H,W], H, W multiples of the coarsest stride
  torch::Tensor colors;             // [cells, K]: each cell's colour as shares of K bins
};

struct CopyLosses {
  torch::Tensor copy;      // cross entropy of the copied colours, nats
  torch::Tensor contrast;  // cross entropy of the attended cells with the true ones, nats; 0 if
                           // no true place is known
};

// `matches` [cells of second, 2]: PhotoSet's, in px of `first`. `bin_weights` [K].
CopyLosses CopyColors(const ConvNextConfig& encoder,
                      const CopyView& first,
                      const CopyView& second,
                      const torch::Tensor& matches,
                      const torch::Tensor& bin_weights,
                      const CopyLossOptions& options,
                      Random& random);

}  // namespace color3d
