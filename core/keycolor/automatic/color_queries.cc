#include "core/keycolor/automatic/color_queries.h"

#include <torch/types.h>

#include <cmath>
#include <numbers>
#include <string>

#include "core/base/error.h"
#include "core/encoder/weight_tensors.h"

namespace color3d {
namespace {

constexpr int64_t kHeads = 8;  // as in all published models; not part of the weights
constexpr double kPositionEpsilon = 1e-6;
constexpr double kPositionTemperature = 10000.0;
constexpr const char* kPrefix = "decoder.color_decoder.";

// Sines and cosines of 1..count, scaled to one turn: [count, width].
torch::Tensor AxisCode(int64_t count, int64_t width) {
  const double scale = 2.0 * std::numbers::pi / (static_cast<double>(count) + kPositionEpsilon);
  const torch::Tensor position = torch::arange(1, count + 1, torch::kFloat32) * scale;
  const torch::Tensor pair = torch::arange(0, width / 2, torch::kFloat32) * 2.0;
  const torch::Tensor period = torch::pow(kPositionTemperature, pair / static_cast<double>(width));
  const torch::Tensor angle = position.unsqueeze(1) / period.unsqueeze(0);
  return torch::stack({angle.sin(), angle.cos()}, 2).flatten(1);
}

// Position of every pixel, [height * width, channels]: first half y, second half x (Carion et al.
// 2020).
torch::Tensor PositionCode(int64_t height, int64_t width, int64_t channels) {
  const torch::Tensor y = AxisCode(height, channels / 2).unsqueeze(1).expand({-1, width, -1});
  const torch::Tensor x = AxisCode(width, channels / 2).unsqueeze(0).expand({height, -1, -1});
  return torch::cat({y, x}, 2).flatten(0, 1);
}

}  // namespace

ColorQueries::Attention ColorQueries::TakeAttention(WeightReader& reader,
                                                    const std::string& name,
                                                    const std::string& inner) const {
  const std::string prefix = name + "." + inner + ".";
  return {TakeLayer(reader, prefix + "in_proj_", {3 * width_, width_}),
          TakeLayer(reader, prefix + "out_proj.", {width_, width_}),
          TakeLayer(reader, name + ".norm.", {width_})};
}

ColorQueries::ColorQueries(const std::vector<int64_t>& feature_channels, WeightReader& reader) {
  const std::string prefix = kPrefix;
  const std::vector<int64_t> queries = reader.ShapeOf(prefix + "query_feat.weight");
  const int64_t query_count = queries.size() == 2 ? queries[0] : 0;
  width_ = queries.size() == 2 ? queries[1] : 0;
  if (width_ % (2 * kHeads) != 0) {
    throw InvalidArgument(
        "the DDColor weights have colour queries of width {}, which is not a multiple of 16",
        width_);
  }
  query_feat_ = TakeTensor(reader, prefix + "query_feat.weight", {query_count, width_});
  query_embed_ = TakeTensor(reader, prefix + "query_embed.weight", {query_count, width_});
  const int64_t levels = static_cast<int64_t>(feature_channels.size());
  level_embed_ = TakeTensor(reader, prefix + "level_embed.weight", {levels, width_}).unbind(0);
  for (int64_t i = 0; i < levels; ++i) {
    input_proj_.push_back(TakeLayer(reader,
                                    prefix + "input_proj." + std::to_string(i) + ".",
                                    {width_, feature_channels[i], 1, 1}));
  }
  for (int64_t i = 0;; ++i) {
    const std::string index = std::to_string(i);
    const std::string feed_forward = prefix + "transformer_ffn_layers." + index + ".";
    const int64_t hidden = StoredSize(reader, feed_forward + "linear1.weight", 0);
    if (hidden == 0 && i > 0) break;
    Block block;
    block.cross = TakeAttention(
        reader, prefix + "transformer_cross_attention_layers." + index, "multihead_attn");
    block.self =
        TakeAttention(reader, prefix + "transformer_self_attention_layers." + index, "self_attn");
    block.linear1 = TakeLayer(reader, feed_forward + "linear1.", {hidden, width_});
    block.linear2 = TakeLayer(reader, feed_forward + "linear2.", {width_, hidden});
    block.norm = TakeLayer(reader, feed_forward + "norm.", {width_});
    blocks_.push_back(std::move(block));
  }
  decoder_norm_ = TakeLayer(reader, prefix + "decoder_norm.", {width_});
  const int64_t embedding = StoredSize(reader, prefix + "color_embed.layers.2.weight", 0);
  for (int i = 0; i < 3; ++i) {
    embed_[i] = TakeLayer(reader,
                          prefix + "color_embed.layers." + std::to_string(i) + ".",
                          {i == 2 ? embedding : width_, width_});
  }
}

torch::Tensor ColorQueries::Attend(const Attention& attention,
                                   const torch::Tensor& queries,
                                   const torch::Tensor& keys,
                                   const torch::Tensor& values) const {
  const std::vector<torch::Tensor> weights = attention.in.weight.chunk(3);
  const std::vector<torch::Tensor> biases = attention.in.bias.chunk(3);
  const int64_t head_width = width_ / kHeads;
  const auto split = [&](const torch::Tensor& x, int part) {  // [heads, rows, head_width]
    return torch::linear(x, weights[part], biases[part])
        .view({x.size(0), kHeads, head_width})
        .transpose(0, 1);
  };
  const torch::Tensor q = split(queries, 0) / std::sqrt(static_cast<double>(head_width));
  const torch::Tensor scores = torch::bmm(q, split(keys, 1).transpose(1, 2)).softmax(-1);
  const torch::Tensor mixed = torch::bmm(scores, split(values, 2)).transpose(0, 1).flatten(1);
  return attention.out.Linear(mixed);
}

torch::Tensor ColorQueries::Forward(const std::vector<torch::Tensor>& levels) const {
  std::vector<torch::Tensor> values, keys;
  for (size_t i = 0; i < levels.size(); ++i) {
    const torch::Tensor projected =
        torch::conv2d(levels[i], input_proj_[i].weight, input_proj_[i].bias);
    values.push_back(projected[0].flatten(1).t() + level_embed_[i]);
    keys.push_back(values.back() + PositionCode(levels[i].size(2), levels[i].size(3), width_));
  }
  torch::Tensor x = query_feat_;
  for (size_t i = 0; i < blocks_.size(); ++i) {
    const Block& block = blocks_[i];
    const size_t level = i % levels.size();
    x = x + Attend(block.cross, x + query_embed_, keys[level], values[level]);
    x = block.cross.norm.Norm(x);
    const torch::Tensor placed = x + query_embed_;
    x = x + Attend(block.self, placed, placed, x);
    x = block.self.norm.Norm(x);
    const torch::Tensor hidden = torch::relu(block.linear1.Linear(x));
    x = x + block.linear2.Linear(hidden);
    x = block.norm.Norm(x);
  }
  x = decoder_norm_.Norm(x);
  x = torch::relu(embed_[0].Linear(x));
  x = torch::relu(embed_[1].Linear(x));
  return embed_[2].Linear(x);
}

}  // namespace color3d
