// Colour by nearest neighbors in the frozen encoder's features (core/matching): no training, and
// as good as some hundred decoder iterations. The bank holds features and ab of the key view. Torch
// in the interface; used inside core/colorizer only. Immutable after construction, thread-safe.
#pragma once

#include <torch/types.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/random.h"
#include "core/color/relative_chroma.h"
#include "core/colorizer/colorizer.h"
#include "core/colorizer/named_tensors.h"
#include "core/encoder/tap_encoder.h"
#include "core/matching/cell_features.h"
#include "core/matching/cell_matches.h"
#include "core/matching/whitening.h"

namespace color3d {

// Defaults measured on three scenes (true colours of held-out views); the error is flat around
// them.
struct FeatureNeighborsOptions {
  int bank_size = 6000;          // cells of the key view, drawn at random
  int further_bank_size = 3000;  // cells of all other pictures together
  double min_weight = 0.25;      // cells of other pictures that are surer than this
  WhiteningOptions whitening;
  VoteOptions vote{.median_steps = 5, .position_weight = 1.5};
  RelativeChroma relative_chroma;  // that the bank's colours are kept relative to
};

struct NeighborColors {
  torch::Tensor ab;        // [2,h,w], relative chroma, Lab units at L = 50, a value per cell
  torch::Tensor distance;  // [h,w], mean squared distance per dimension of the best match
  torch::Tensor variance;  // [h,w], of the matches' ab, Lab units squared: how far they disagree
};

class FeatureNeighbors {
 public:
  // Pictures at training size, the key view first: the feature space is its, the others add cells
  // whose colours are known (weight) and, where positions are known, what features differ by
  // between views of one place.
  FeatureNeighbors(const TapEncoder& encoder,
                   std::span<const TrainingPicture> pictures,
                   const FeatureNeighborsOptions& options,
                   Random random,
                   const CancellationToken& cancel);

  // `taps` of a padded picture [1,*,*,*] and its L [1,1,H,W]; H, W multiples of kCellPx. `wanted`
  // [h,w] (bool): cells that need an answer, the others get grey at distance 0; undefined: all.
  // `position`: PictureFacts', of the size before padding.
  NeighborColors Lookup(const std::vector<torch::Tensor>& taps,
                        const torch::Tensor& luminance,
                        const torch::Tensor& wanted = {},
                        const Image& position = {}) const;

  const CellBank& bank() const { return bank_; }
  const Whitening& whitening() const { return whitening_; }

  // Adds the arrays "neighbors.*"; the bank is rounded to half precision already, and stored so.
  void PutInto(TensorFile* file) const;
  // Takes the arrays "neighbors.*" out of the file. Throws Error{kInvalidArgument} starting with
  // `what` when one is missing or does not fit.
  static std::unique_ptr<FeatureNeighbors> TakeFrom(const TapEncoder& encoder,
                                                    const FeatureNeighborsOptions& options,
                                                    const std::string& what,
                                                    TensorFile* file);

 private:
  FeatureNeighbors(const TapEncoder& encoder,
                   const FeatureNeighborsOptions& options,
                   Whitening whitening,
                   CellBank bank);

  ConvNextConfig encoder_;  // strides of the taps
  FeatureNeighborsOptions options_;
  Whitening whitening_;
  CellBank bank_;
};

}  // namespace color3d
