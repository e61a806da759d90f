// The two towers of CLIP (Radford et al. 2021): a vision transformer for pictures, a causal
// transformer for text, with a common space of features. Torch in the interface. Immutable,
// thread-safe. For this folder only.
#pragma once

#include <torch/types.h>

#include <string>
#include <vector>

#include "core/encoder/weight_tensors.h"
#include "core/weights/weight_reader.h"

namespace color3d {

class ClipNetwork {
 public:
  // `weights` under OpenAI's names. `quick_gelu`: x * sigmoid(1.702 x) in the feed-forward layers,
  // else the exact GELU. The text tower is optional. Throws Error{kInvalidArgument} listing weights
  // that are missing, unexpected or misshapen.
  ClipNetwork(WeightMap weights, bool quick_gelu);

  int input_side_px() const { return grid_ * patch_px_; }
  int grid() const { return grid_; }  // patches per side
  bool HasText() const { return token_embedding_.defined(); }
  int vocabulary_size() const;
  int context() const;
  std::string ToString() const;

  // Returns [B,E] for pictures [B,3,S,S] in 0..1, S = input_side_px().
  torch::Tensor EncodeImages(const torch::Tensor& rgb) const;
  // Returns dense features [B,E,grid,grid]. The last layer's attention is replaced by its value
  // path, so that features stay local to each patch (Zhou et al. 2022, "Extract free dense labels
  // from CLIP").
  torch::Tensor EncodePatches(const torch::Tensor& rgb) const;
  // Returns [B,E] for token numbers [B,T], T <= context(). The feature is that of the largest
  // number, the end of text.
  torch::Tensor EncodeTokens(const torch::Tensor& tokens) const;

 private:
  struct Block {
    Layer in, out, norm1, norm2, expand, contract;
  };
  struct Tower {
    int64_t width = 0;
    int64_t heads = 0;
    std::vector<Block> blocks;
  };
  static Tower TakeTower(WeightReader& reader, const std::string& prefix, int64_t width);
  void TakeVision(WeightReader& reader);
  void TakeText(WeightReader& reader);
  torch::Tensor RunBlock(const Tower& tower,
                         const Block& block,
                         const torch::Tensor& x,
                         bool causal) const;
  // Returns tokens [B, 1 + grid^2, width] after all blocks but the last `left_out`.
  torch::Tensor RunVision(const torch::Tensor& rgb, int left_out) const;

  bool quick_gelu_;
  int grid_ = 0;
  int patch_px_ = 0;
  Tower vision_, text_;
  torch::Tensor patch_weight_, class_embedding_, vision_position_, vision_projection_;
  Layer norm_pre_, norm_post_;
  torch::Tensor token_embedding_, text_position_, text_projection_;
  Layer norm_final_;
};

}  // namespace color3d
