// Colour head of the embedded automatic colourizer: maps the frozen encoder's taps to a
// distribution over colour bins. A feature pyramid (Lin et al. 2017): coarse taps identify things,
// fine ones their outlines. Torch in the interface; used by the automatic colourizer and its
// pre-training only. Forward is const and thread-safe.
#pragma once

#include <torch/types.h>

#include <string>
#include <utility>
#include <vector>

#include "core/base/random.h"
#include "core/encoder/convnext/convnext_config.h"

namespace color3d {

class ColorHead {
 public:
  // Initializes the parameters at random. Requires: `encoder` has at least 3 taps. All but the
  // finest are used.
  ColorHead(const ConvNextConfig& encoder, int bin_count, Random& random);

  // Returns logits [B,bins,h,w] at the second tap's stride, from the taps of ConvNext::Taps.
  torch::Tensor Forward(const std::vector<torch::Tensor>& taps) const;

  // Parameters by name, in a fixed order. Shares storage.
  const std::vector<std::pair<std::string, torch::Tensor>>& Parameters() const {
    return parameters_;
  }

 private:
  struct Level {
    torch::Tensor lateral, lateral_bias;  // 1x1, tap -> width
    torch::Tensor fuse, fuse_bias;        // 3x3, width -> next finer width
  };
  torch::Tensor NewWeight(const std::string& name,
                          std::vector<int64_t> shape,
                          double gain,
                          Random& random);

  std::vector<Level> levels_;  // coarse to fine
  torch::Tensor norm_weight_, norm_bias_;
  torch::Tensor out_, out_bias_;
  std::vector<std::pair<std::string, torch::Tensor>> parameters_;
};

}  // namespace color3d
