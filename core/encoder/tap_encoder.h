// Encoder with access to its feature maps (taps), for the colorizer and for matching of pictures.
// Torch in the interface. Immutable, thread-safe.
#pragma once

#include <torch/types.h>

#include <functional>
#include <vector>

#include "core/encoder/convnext/convnext_config.h"
#include "core/encoder/encoder.h"

namespace color3d {

class TapEncoder : public Encoder {
 public:
  // Adapter of a block: maps the block's input [B,C,h,w] to a term of the same shape that is added
  // to the output of its depth-wise convolution, or to an undefined tensor for none.
  using BlockAdapter = std::function<torch::Tensor(int stage, int block, const torch::Tensor&)>;

  // Channels, strides and blocks of the taps.
  virtual const ConvNextConfig& config() const = 0;
  // Returns the network input [B,3,H,W] for L [B,1,H,W] (0..100): the grey picture Lab(L,0,0) in
  // sRGB, normalised as the network was trained.
  virtual torch::Tensor Input(const torch::Tensor& luminance) const = 0;
  // Returns taps [B, dims[i], H / Stride(i), W / Stride(i)], fine to coarse, channels-last.
  // Requires: H and W are multiples of the last stride. Gradients flow to the adapter, never to the
  // weights.
  virtual std::vector<torch::Tensor> Taps(const torch::Tensor& input,
                                          const BlockAdapter& adapter = {}) const = 0;
  // Taps with matrix products in bfloat16 if the network supports them. Relative error about 1 %.
  virtual std::vector<torch::Tensor> FastTaps(const torch::Tensor& input) const {
    return Taps(input);
  }
};

}  // namespace color3d
