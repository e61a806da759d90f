// ConvNeXt as frozen feature extractor. Torch in the interface. Immutable, thread-safe.
#pragma once

#include <torch/types.h>

#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/encoder/convnext/convnext_config.h"
#include "core/encoder/tap_encoder.h"
#include "core/encoder/weight_tensors.h"
#include "core/weights/weight_map.h"

namespace color3d {

class ConvNext : public TapEncoder {
 public:
  // Takes over the memory of the weights. Throws Error{kInvalidArgument} naming weights that are
  // missing, unexpected or not of the shape that `config` requires.
  ConvNext(const ConvNextConfig& config, WeightMap weights, std::string description);

  const ConvNextConfig& config() const override { return config_; }
  // All weights by published name, in a fixed order. Shares storage. For pre-training only: a
  // caller that enables gradients or changes values must be the only user, and digest() remains
  // that of the original weights.
  const std::vector<std::pair<std::string, torch::Tensor>>& Parameters() const {
    return parameters_;
  }
  const std::string& digest() const override { return digest_; }
  const std::string& description() const override { return description_; }
  std::vector<double> Describe(const Image& luminance) const override;
  Image DeepFeatures(const Image& luminance) const override;

  // Returns the network input [B,3,H,W] for L [B,1,H,W] (0..100): the grey picture Lab(L,0,0) in
  // sRGB, normalised with ImageNet's statistics.
  torch::Tensor Input(const torch::Tensor& luminance) const override;
  // Normalises RGB in 0..1, [B,3,H,W], with ImageNet's statistics. Channels-last.
  static torch::Tensor NormalizeInput(const torch::Tensor& rgb);
  // Returns norm0 .. norm3: taps [B, dims[i], H / Stride(i), W / Stride(i)], channels-last.
  // Requires: H and W are multiples of the last stride. Gradients flow to the adapter, never to the
  // weights.
  std::vector<torch::Tensor> Taps(const torch::Tensor& input,
                                  const BlockAdapter& adapter = {}) const override;
  // The first call makes bfloat16 copies of the matrices (half of the weights' memory).
  std::vector<torch::Tensor> FastTaps(const torch::Tensor& input) const override;
  // Outputs of the first `count` stages, before the taps' norms.
  std::vector<torch::Tensor> StageOutputs(const torch::Tensor& input,
                                          int count,
                                          const BlockAdapter& adapter = {}) const;

 private:
  struct Block {
    Layer dwconv, norm, pwconv1, pwconv2;
    torch::Tensor gamma;
  };
  struct Stage {
    Layer down, down_norm, norm;
    std::vector<Block> blocks;
  };
  // Weights of the two matrix products of a block, in float32 or bfloat16.
  using Products = std::pair<torch::Tensor, torch::Tensor>;
  torch::Tensor RunBlock(const Block& block,
                         const Products& products,
                         const torch::Tensor& x,
                         const torch::Tensor& adapted) const;
  torch::Tensor Downsample(int stage, const torch::Tensor& x) const;
  std::vector<torch::Tensor> NormalizeTaps(std::vector<torch::Tensor> outputs) const;
  torch::Tensor DeepTap(const Image& luminance, int max_side_px, int stage) const;

  ConvNextConfig config_;
  std::string digest_;
  std::string description_;
  std::vector<Stage> stages_;
  std::vector<std::pair<std::string, torch::Tensor>> parameters_;
  mutable std::once_flag half_once_;
  mutable std::vector<std::vector<Products>> half_products_;  // by stage and block
};

}  // namespace color3d
