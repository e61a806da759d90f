// DDColor's pixel decoder and output layer (Kang et al. 2023), on the taps of its ConvNeXt. Torch
// in the interface; used inside core/keycolor only. Immutable, thread-safe.
#pragma once

#include <torch/types.h>

#include <memory>
#include <string>
#include <vector>

#include "core/keycolor/automatic/color_queries.h"
#include "core/keycolor/automatic/folded_norms.h"
#include "core/weights/weight_reader.h"

namespace color3d {

class DdcolorDecoder {
 public:
  // Takes "decoder.*" and "refine_net.*" and finishes `reader`; `dims` are the encoder's. Throws
  // Error{kInvalidArgument} as WeightReader::Finish, or naming a norm that cannot be folded.
  DdcolorDecoder(const std::vector<int>& dims, WeightReader& reader);

  int64_t query_count() const { return queries_->query_count(); }
  // Returns ab [1,2,H,W] in Lab units for the encoder's four taps (strides 4..32) and the network
  // input [1,3,H,W] (grey RGB, ImageNet-normalised). Requires: H and W are multiples of 32.
  torch::Tensor Forward(const std::vector<torch::Tensor>& taps, const torch::Tensor& input) const;

 private:
  struct UpBlock {
    torch::Tensor shuffle_weight, shuffle_bias;  // spectral and batch norm folded
    ChannelAffine skip;                          // batch norm of the tap
    torch::Tensor conv_weight;
    ChannelAffine out;  // batch norm after the rectifier
  };
  struct Problems;
  UpBlock TakeUpBlock(
      const std::string& name, int64_t in, int64_t skip, WeightReader& reader, Problems& problems);
  torch::Tensor RunUpBlock(const UpBlock& block,
                           const torch::Tensor& x,
                           const torch::Tensor& tap) const;

  std::vector<UpBlock> blocks_;  // coarse to fine
  std::unique_ptr<const ColorQueries> queries_;
  torch::Tensor last_weight_, last_bias_;      // rows ordered (sub-pixel, channel)
  torch::Tensor refine_weight_, refine_bias_;  // [2, queries + 3], [2]
};

}  // namespace color3d
