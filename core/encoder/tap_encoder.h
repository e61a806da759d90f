// An encoder that shows its feature maps, with torch in the interface: for the colorizer and for
// matching pictures. Immutable after construction; Taps() may be called from any number of threads.
#pragma once

#include <torch/types.h>

#include <functional>
#include <vector>

#include "core/encoder/convnext/convnext_config.h"
#include "core/encoder/encoder.h"

namespace color3d {

class TapEncoder : public Encoder {
 public:
  // Added to the output of a block's depth-wise convolution: gets the block's input [B,C,h,w] and
  // returns the same shape, or an undefined tensor for nothing.
  using BlockAdapter = std::function<torch::Tensor(int stage, int block, const torch::Tensor&)>;

  // Channels, strides and blocks of the taps.
  virtual const ConvNextConfig& config() const = 0;
  // Network input [B,3,H,W] of L [B,1,H,W] (0..100): the grey picture Lab(L,0,0) in sRGB,
  // normalised as the network was trained.
  virtual torch::Tensor Input(const torch::Tensor& luminance) const = 0;
  // Taps [B, dims[i], H / Stride(i), W / Stride(i)], fine to coarse, channels-last. H and W must be
  // multiples of the last stride. Gradients flow to the adapter, never to the frozen weights.
  virtual std::vector<torch::Tensor> Taps(const torch::Tensor& input,
                                          const BlockAdapter& adapter = {}) const = 0;
  // The same with matrix products in bfloat16 where the network can do that; about 1 % off.
  virtual std::vector<torch::Tensor> FastTaps(const torch::Tensor& input) const {
    return Taps(input);
  }
};

}  // namespace color3d
