// The general part of the feed-forward colorizer (STILL.md "Feed-forward variant"): a small network
// that corrects the colours which the feature neighbours take from the key view. Trained once, on
// photographs, not on the scene (CARD.md). Torch in the interface; used inside core/colorizer and
// by its pre-training. Thread-safe while nothing trains it.
#pragma once

#include <torch/types.h>

#include <memory>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/colorizer/model/named_tensors.h"
#include "core/colorizer/neighbors/feature_neighbors.h"
#include "core/encoder/convnext/convnext_config.h"
#include "core/weights/weight_map.h"

namespace color3d {

class ExemplarHead {
 public:
  // Random weights that answer with the neighbours' colours unchanged.
  ExemplarHead(const ConvNextConfig& encoder, Random& random);
  // The embedded weights. Throws Error{kFailedPrecondition} for an encoder other than the embedded
  // one, on whose features they were trained.
  static std::shared_ptr<const ExemplarHead> Embedded(const TapEncoder& encoder);

  // Corrected colours [2,h,w] of `found`, with its units. `taps` and `luminance` [1,1,H,W] as for
  // FeatureNeighbors::Lookup.
  torch::Tensor Refine(const std::vector<torch::Tensor>& taps,
                       const torch::Tensor& luminance,
                       const NeighborColors& found) const;

  // Storage is shared.
  NamedTensors parameters() const { return parameters_; }
  WeightMap Weights() const;
  // Throws Error{kInvalidArgument} naming an array that is missing or misshapen.
  void SetWeights(const WeightMap& weights);

 private:
  torch::Tensor New(const std::string& name, std::vector<int64_t> shape, double deviation, Random&);

  NamedTensors parameters_;
};

}  // namespace color3d
