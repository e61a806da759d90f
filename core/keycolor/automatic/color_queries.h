// DDColor's colour decoder (Kang et al. 2023, section 3.3): learnt colour queries with cross
// attention to the picture's features and self attention. Torch in the interface; used inside
// core/keycolor only. Immutable, thread-safe.
#pragma once

#include <torch/types.h>

#include <vector>

#include "core/encoder/weight_tensors.h"
#include "core/weights/weight_reader.h"

namespace color3d {

class ColorQueries {
 public:
  // Takes "decoder.color_decoder.*". `feature_channels`: channels of the decoder's levels, coarse
  // to fine.
  ColorQueries(const std::vector<int64_t>& feature_channels, WeightReader& reader);

  int64_t query_count() const { return query_feat_.size(0); }
  // Width of a query's embedding and of the pixel features that it is multiplied with.
  int64_t embedding_channels() const { return embed_[2].weight.size(0); }
  // Returns [query_count, embedding_channels] for the decoder's levels [1,C,h,w], coarse to fine.
  torch::Tensor Forward(const std::vector<torch::Tensor>& levels) const;

 private:
  struct Attention {
    Layer in;  // q, k, v stacked
    Layer out;
    Layer norm;
  };
  struct Block {
    Attention cross, self;
    Layer linear1, linear2, norm;
  };

  Attention TakeAttention(WeightReader& reader,
                          const std::string& name,
                          const std::string& inner) const;
  torch::Tensor Attend(const Attention& attention,
                       const torch::Tensor& queries,
                       const torch::Tensor& keys,
                       const torch::Tensor& values) const;

  int64_t width_ = 0;
  torch::Tensor query_feat_, query_embed_;
  std::vector<torch::Tensor> level_embed_;
  std::vector<Layer> input_proj_;
  std::vector<Block> blocks_;
  Layer decoder_norm_;
  Layer embed_[3];
};

}  // namespace color3d
