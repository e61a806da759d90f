// ConvNeXt as frozen feature extractor, with torch in the interface.
// Immutable after construction; Taps() may be called from any number of threads.
#pragma once

#include <torch/types.h>

#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/encoder/convnext/convnext_config.h"
#include "core/encoder/tap_encoder.h"
#include "core/weights/weight_map.h"

namespace color3d {

class ConvNext : public TapEncoder {
 public:
  // Throws Error{kInvalidArgument} naming the weights that are missing, unexpected or have another
  // shape than `config` asks for. Takes the weights' memory over.
  ConvNext(const ConvNextConfig& config, WeightMap weights, std::string description);

  const ConvNextConfig& config() const override { return config_; }
  // Every weight by its published name, in a fixed order; storage is shared. For pre-training only:
  // whoever switches gradients on or changes a value owns the object alone, and its digest is that
  // of the weights it was made from.
  std::vector<std::pair<std::string, torch::Tensor>> Parameters() const;
  const std::string& digest() const override { return digest_; }
  const std::string& description() const override { return description_; }
  std::vector<double> Describe(const Image& luminance) const override;
  Image DeepFeatures(const Image& luminance) const override;

  // Network input [B,3,H,W] of L [B,1,H,W] (0..100): the grey picture Lab(L,0,0) in sRGB,
  // normalised with ImageNet's statistics.
  torch::Tensor Input(const torch::Tensor& luminance) const override;
  // RGB in 0..1, [B,3,H,W], normalised with ImageNet's statistics, channels-last.
  static torch::Tensor NormaliseInput(const torch::Tensor& rgb);
  // norm0 .. norm3: taps [B, dims[i], H / Stride(i), W / Stride(i)], channels-last. H and W must be
  // multiples of the last stride. Gradients flow to the adapter, never to the frozen weights.
  std::vector<torch::Tensor> Taps(const torch::Tensor& input,
                                  const BlockAdapter& adapter = {}) const override;
  // The first call makes bfloat16 copies of the matrices (half the weights' memory again).
  std::vector<torch::Tensor> FastTaps(const torch::Tensor& input) const override;
  // What the stages hand on, before the taps' norms; only the first `count` stages are run.
  std::vector<torch::Tensor> StageOutputs(const torch::Tensor& input,
                                          int count,
                                          const BlockAdapter& adapter = {}) const;

 private:
  struct Block {
    torch::Tensor dwconv_weight, dwconv_bias, norm_weight, norm_bias;
    torch::Tensor pwconv1_weight, pwconv1_bias, pwconv2_weight, pwconv2_bias, gamma;
  };
  struct Stage {
    torch::Tensor down_weight, down_bias, down_norm_weight, down_norm_bias;
    torch::Tensor norm_weight, norm_bias;
    std::vector<Block> blocks;
  };
  // Weights of a block's two matrix products, in float32 or bfloat16.
  using Products = std::pair<torch::Tensor, torch::Tensor>;
  torch::Tensor RunBlock(const Block& block,
                         const Products& products,
                         const torch::Tensor& x,
                         const torch::Tensor& adapted) const;
  torch::Tensor Downsample(int stage, const torch::Tensor& x) const;
  std::vector<torch::Tensor> NormaliseTaps(std::vector<torch::Tensor> outputs) const;
  torch::Tensor DeepTap(const Image& luminance, int max_side_px, int stage) const;

  ConvNextConfig config_;
  std::string digest_;
  std::string description_;
  std::vector<Stage> stages_;
  mutable std::once_flag half_once_;
  mutable std::vector<std::vector<Products>> half_products_;  // by stage and block
};

}  // namespace color3d
