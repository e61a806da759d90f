// Colour by nearest neighbours in the frozen encoder's features: no training, and as good as some
// hundred decoder iterations. The bank holds features and ab of the key view. Torch in the
// interface; used inside core/colorizer only. Immutable after construction, thread-safe.
#pragma once

#include <torch/types.h>

#include <map>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/random.h"
#include "core/encoder/convnext.h"

namespace color3d {

struct FeatureNeighboursOptions {
  std::vector<double> scales{0.8, 1.0, 1.25};  // of the key view, so that sizes may differ
  int bank_size = 16000;
  int dims_per_tap = 24;       // kept by PCA
  std::vector<double> tap_weights{1.0, 1.0, 1.0, 1.0};
  double luminance_weight = 1.0;
  double position_weight = 0.0;
  double temperature = 0.15;   // of the softmax, relative to the distance of the best match
  int stride = 4;              // px between two answers
};

struct NeighbourColors {
  torch::Tensor ab;        // [2,h,w], Lab units, h = H / stride
  torch::Tensor distance;  // [h,w], mean squared distance per dimension of the best match
};

class FeatureNeighbours {
 public:
  // `luminance` 1 channel, `ab` 2 channels: the key view at training size.
  FeatureNeighbours(const ConvNext& encoder,
                    const Image& luminance,
                    const Image& ab,
                    const FeatureNeighboursOptions& options,
                    Random random,
                    const CancellationToken& cancel);
  // From State().
  FeatureNeighbours(const FeatureNeighboursOptions& options,
                    std::map<std::string, torch::Tensor> state);

  // `taps` of a padded picture [1,*,*,*] and its L [1,1,H,W]; H, W multiples of the stride.
  NeighbourColors Lookup(const ConvNext& encoder,
                         const std::vector<torch::Tensor>& taps,
                         const torch::Tensor& luminance) const;

  // Tensors that rebuild the bank: projection, offsets, bank (float16), colours.
  std::map<std::string, torch::Tensor> State() const { return state_; }

 private:
  torch::Tensor Features(const ConvNext& encoder,
                         const std::vector<torch::Tensor>& taps,
                         const torch::Tensor& luminance) const;

  FeatureNeighboursOptions options_;
  std::map<std::string, torch::Tensor> state_;
};

}  // namespace color3d
