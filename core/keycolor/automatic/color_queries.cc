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
constexpr double kLayerNormEpsilon = 1e-5;
constexpr double kPositionEpsilon = 1e-6;
constexpr double kPositionTemperature = 10000.0;
constexpr const char* kPrefix = "decoder.color_decoder.";

torch::Tensor LayerNorm(const torch::Tensor& x,
                        const torch::Tensor& weight,
                        const torch::Tensor& bias) {
  return torch::layer_norm(x, {x.size(-1)}, weight, bias, kLayerNormEpsilon);
}

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

int64_t FirstSize(const WeightReader& reader, const std::string& name) {
  const std::vector<int64_t> shape = reader.ShapeOf(name);
  return shape.empty() ? 0 : shape[0];
}

}  // namespace

ColorQueries::Linear ColorQueries::TakeLinear(WeightReader& reader,
                                              const std::string& name,
                                              const std::vector<int64_t>& shape) {
  Linear linear;
  linear.weight = TakeTensor(reader, name + ".weight", shape);
  linear.bias = TakeTensor(reader, name + ".bias", {shape[0]});
  return linear;
}

ColorQueries::Attention ColorQueries::TakeAttention(WeightReader& reader,
                                                    const std::string& name,
                                                    const std::string& inner) const {
  Attention attention;
  const std::string prefix = name + "." + inner + ".";
  attention.in_weight = TakeTensor(reader, prefix + "in_proj_weight", {3 * width_, width_});
  attention.in_bias = TakeTensor(reader, prefix + "in_proj_bias", {3 * width_});
  attention.out = TakeLinear(reader, prefix + "out_proj", {width_, width_});
  attention.norm = TakeLinear(reader, name + ".norm", {width_});
  return attention;
}

ColorQueries::ColorQueries(const std::vector<int64_t>& feature_channels, WeightReader& reader) {
  const std::string prefix = kPrefix;
  const std::vector<int64_t> queries = reader.ShapeOf(prefix + "query_feat.weight");
  const int64_t query_count = queries.size() == 2 ? queries[0] : 0;
  width_ = queries.size() == 2 ? queries[1] : 0;
  if (width_ % (2 * kHeads) != 0) {
    throw InvalidArgument(
        "the DDColor weights have colour queries of width {}, which is no multiple of 16", width_);
  }
  query_feat_ = TakeTensor(reader, prefix + "query_feat.weight", {query_count, width_});
  query_embed_ = TakeTensor(reader, prefix + "query_embed.weight", {query_count, width_});
  const int64_t levels = static_cast<int64_t>(feature_channels.size());
  level_embed_ = TakeTensor(reader, prefix + "level_embed.weight", {levels, width_}).unbind(0);
  for (int64_t i = 0; i < levels; ++i) {
    input_proj_.push_back(TakeLinear(
        reader, prefix + "input_proj." + std::to_string(i), {width_, feature_channels[i], 1, 1}));
  }
  for (int64_t i = 0;; ++i) {
    const std::string index = std::to_string(i);
    const std::string feed_forward = prefix + "transformer_ffn_layers." + index;
    const int64_t hidden = FirstSize(reader, feed_forward + ".linear1.weight");
    if (hidden == 0 && i > 0) break;
    Layer layer;
    layer.cross = TakeAttention(
        reader, prefix + "transformer_cross_attention_layers." + index, "multihead_attn");
    layer.self =
        TakeAttention(reader, prefix + "transformer_self_attention_layers." + index, "self_attn");
    layer.linear1 = TakeLinear(reader, feed_forward + ".linear1", {hidden, width_});
    layer.linear2 = TakeLinear(reader, feed_forward + ".linear2", {width_, hidden});
    layer.norm = TakeLinear(reader, feed_forward + ".norm", {width_});
    layers_.push_back(std::move(layer));
  }
  decoder_norm_ = TakeLinear(reader, prefix + "decoder_norm", {width_});
  const int64_t embedding = FirstSize(reader, prefix + "color_embed.layers.2.weight");
  for (int i = 0; i < 3; ++i) {
    embed_[i] = TakeLinear(reader,
                           prefix + "color_embed.layers." + std::to_string(i),
                           {i == 2 ? embedding : width_, width_});
  }
}

torch::Tensor ColorQueries::Attend(const Attention& attention,
                                   const torch::Tensor& queries,
                                   const torch::Tensor& keys,
                                   const torch::Tensor& values) const {
  const std::vector<torch::Tensor> weights = attention.in_weight.chunk(3);
  const std::vector<torch::Tensor> biases = attention.in_bias.chunk(3);
  const int64_t head_width = width_ / kHeads;
  const auto split = [&](const torch::Tensor& x, int part) {  // [heads, rows, head_width]
    return torch::linear(x, weights[part], biases[part])
        .view({x.size(0), kHeads, head_width})
        .transpose(0, 1);
  };
  const torch::Tensor q = split(queries, 0) / std::sqrt(static_cast<double>(head_width));
  const torch::Tensor scores = torch::bmm(q, split(keys, 1).transpose(1, 2)).softmax(-1);
  const torch::Tensor mixed = torch::bmm(scores, split(values, 2)).transpose(0, 1).flatten(1);
  return torch::linear(mixed, attention.out.weight, attention.out.bias);
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
  for (size_t i = 0; i < layers_.size(); ++i) {
    const Layer& layer = layers_[i];
    const size_t level = i % levels.size();
    x = x + Attend(layer.cross, x + query_embed_, keys[level], values[level]);
    x = LayerNorm(x, layer.cross.norm.weight, layer.cross.norm.bias);
    const torch::Tensor placed = x + query_embed_;
    x = x + Attend(layer.self, placed, placed, x);
    x = LayerNorm(x, layer.self.norm.weight, layer.self.norm.bias);
    const torch::Tensor hidden =
        torch::relu(torch::linear(x, layer.linear1.weight, layer.linear1.bias));
    x = x + torch::linear(hidden, layer.linear2.weight, layer.linear2.bias);
    x = LayerNorm(x, layer.norm.weight, layer.norm.bias);
  }
  x = LayerNorm(x, decoder_norm_.weight, decoder_norm_.bias);
  x = torch::relu(torch::linear(x, embed_[0].weight, embed_[0].bias));
  x = torch::relu(torch::linear(x, embed_[1].weight, embed_[1].bias));
  return torch::linear(x, embed_[2].weight, embed_[2].bias);
}

}  // namespace color3d
