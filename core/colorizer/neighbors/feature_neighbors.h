// Colour from nearest neighbors in the frozen encoder's features (core/matching). Needs no training
// and is as accurate as some hundred iterations of the decoder. The bank holds features and ab of
// the key view. Torch in the interface; used inside core/colorizer only. Immutable, thread-safe.
#pragma once

#include <torch/types.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/base/random.h"
#include "core/color/relative_chroma.h"
#include "core/colorizer/colorizer.h"
#include "core/colorizer/model/named_tensors.h"
#include "core/encoder/tap_encoder.h"
#include "core/matching/cell_features.h"
#include "core/matching/cell_matches.h"
#include "core/matching/whitening.h"

namespace color3d {

// Defaults minimize the error on three scenes (true colours of held-out views); the minimum is
// flat.
struct FeatureNeighborsOptions {
  int bank_size = 6000;          // cells of the key view, sampled at random
  int further_bank_size = 3000;  // cells of all other pictures together
  double min_weight = 0.25;      // minimum weight of cells of other pictures
  WhiteningOptions whitening;
  VoteOptions vote{.median_steps = 5, .position_weight = 1.5};
  RelativeChroma relative_chroma;  // luminance model that the bank's colours are relative to
};

struct NeighborColors {
  torch::Tensor ab;        // [2,h,w], relative chroma, Lab units at L = 50, one value per cell
  torch::Tensor distance;  // [h,w], mean squared distance per dimension of the best match
  torch::Tensor variance;  // [h,w], variance of the matches' ab, Lab units squared
};

class FeatureNeighbors {
 public:
  // `pictures` at training size, the key view first. The key view defines the feature space. The
  // others add cells with known colours (by weight) and, where positions are known, the variation
  // of features between views of one place. `helpers` describe several pictures at once, without
  // effect on the result; null: none.
  FeatureNeighbors(const TapEncoder& encoder,
                   std::span<const TrainingPicture> pictures,
                   const FeatureNeighborsOptions& options,
                   Random random,
                   const CancellationToken& cancel,
                   ThreadPool* helpers = nullptr);

  // `taps` of a padded picture [1,*,*,*] and its L [1,1,H,W]; H, W multiples of kCellPx. `wanted`
  // [h,w] (bool): cells to look up, undefined: all; the others get grey at distance 0. `position`:
  // PictureFacts::position, of the size before padding.
  NeighborColors Lookup(const std::vector<torch::Tensor>& taps,
                        const torch::Tensor& luminance,
                        const torch::Tensor& wanted = {},
                        const Image& position = {}) const;

  const CellBank& bank() const { return bank_; }
  const Whitening& whitening() const { return whitening_; }
  // [m]: variance of the matches' ab, Lab units squared, of cells without a colour, which are
  // sampled from all pictures but the key view. Empty if there are none. Not part of the file.
  const torch::Tensor& open_variance() const { return open_variance_; }

  // Adds the arrays "neighbors.*". The bank is in half precision already.
  void PutInto(TensorFile* file) const;
  // Marks all positions in the file as unknown, if it has neighbors.
  static void ForgetPositions(TensorFile* file);
  // Moves the arrays "neighbors.*" out of the file. Throws Error{kInvalidArgument} starting with
  // `what` if one is missing or does not fit.
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
  torch::Tensor open_variance_ = torch::empty({0});
};

}  // namespace color3d
