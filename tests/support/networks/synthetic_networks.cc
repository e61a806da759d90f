#include "tests/support/networks/synthetic_networks.h"

#include <fmt/core.h>

#include <cmath>
#include <string>
#include <utility>

#include "core/base/random.h"
#include "tests/support/networks/random_features.h"

namespace color3d {
namespace {

class Maker {
 public:
  Maker(uint64_t seed, WeightMap& weights) : random_(seed, /*stream=*/0x73796e), out_(weights) {}

  WeightArray& Fill(const std::string& name, std::vector<int64_t> shape, float value) {
    int64_t count = 1;
    for (const int64_t size : shape) count *= size;
    out_[name] = {std::move(shape), std::vector<float>(static_cast<size_t>(count), value)};
    return out_[name];
  }
  WeightArray& Normal(const std::string& name,
                      std::vector<int64_t> shape,
                      double deviation,
                      double mean = 0.0) {
    WeightArray& array = Fill(name, std::move(shape), 0.0f);
    for (float& value : array.values) {
      value = static_cast<float>(mean + deviation * random_.NextNormal());
    }
    return array;
  }
  // Weight and bias of a layer that keeps the size of its input.
  void Linear(const std::string& name, std::vector<int64_t> shape) {
    const double fan_in = FanIn(shape);
    const int64_t out = shape[0];
    Normal(name + "weight", std::move(shape), 1.0 / std::sqrt(fan_in));
    Normal(name + "bias", {out}, 0.02);
  }
  void Norm(const std::string& name, int64_t channels) {
    Normal(name + "weight", {channels}, 0.1, 1.0);
    Normal(name + "bias", {channels}, 0.05);
  }
  void BatchNorm(const std::string& name, int64_t channels) {
    Norm(name, channels);
    Normal(name + "running_mean", {channels}, 0.05);
    for (float& value : Normal(name + "running_var", {channels}, 0.02, 0.1).values) {
      value = std::abs(value) + 0.01f;
    }
    Fill(name + "num_batches_tracked", {}, 1000.0f);
  }
  void Spectral(const std::string& name, const std::vector<int64_t>& shape) {
    const WeightArray weight = Normal(name + "weight_orig", shape, 1.0 / std::sqrt(FanIn(shape)));
    const auto rows = static_cast<size_t>(shape[0]);
    const size_t columns = weight.values.size() / rows;
    std::vector<float> u(rows), v(columns);
    for (float& value : u) value = static_cast<float>(random_.NextNormal());
    for (int i = 0; i < kPowerIterations; ++i) {
      v.assign(columns, 0.0f);
      for (size_t r = 0; r < rows; ++r) {
        const float* row = &weight.values[r * columns];
        for (size_t c = 0; c < columns; ++c) v[c] += u[r] * row[c];
      }
      Normalise(v);
      for (size_t r = 0; r < rows; ++r) {
        const float* row = &weight.values[r * columns];
        double sum = 0.0;
        for (size_t c = 0; c < columns; ++c) sum += row[c] * v[c];
        u[r] = static_cast<float>(sum);
      }
      Normalise(u);
    }
    out_[name + "weight_u"] = {{shape[0]}, std::move(u)};
    out_[name + "weight_v"] = {{static_cast<int64_t>(columns)}, std::move(v)};
  }

 private:
  static constexpr int kPowerIterations = 8;

  static double FanIn(const std::vector<int64_t>& shape) {
    double fan_in = 1.0;
    for (size_t i = 1; i < shape.size(); ++i) fan_in *= static_cast<double>(shape[i]);
    return fan_in;
  }
  static void Normalise(std::vector<float>& vector) {
    double sum = 1e-30;
    for (const float value : vector) sum += static_cast<double>(value) * value;
    for (float& value : vector) value = static_cast<float>(value / std::sqrt(sum));
  }

  Random random_;
  WeightMap& out_;
};

void AddColorDecoder(const SyntheticDdcolor& sizes,
                     const std::vector<int64_t>& channels,
                     Maker& make) {
  const std::string prefix = "decoder.color_decoder.";
  const int64_t width = sizes.query_channels;
  make.Normal(prefix + "query_feat.weight", {sizes.queries, width}, 1.0);
  make.Normal(prefix + "query_embed.weight", {sizes.queries, width}, 1.0);
  make.Normal(prefix + "level_embed.weight", {3, width}, 1.0);
  for (int i = 0; i < 3; ++i) {
    make.Linear(fmt::format("{}input_proj.{}.", prefix, i), {width, channels[i], 1, 1});
    make.Linear(fmt::format("{}color_embed.layers.{}.", prefix, i), {width, width});
  }
  const auto attention = [&](const std::string& name, const std::string& inner) {
    const WeightArray& stacked = make.Normal(
        name + inner + ".in_proj_weight", {3 * width, width}, 1.0 / std::sqrt(double(width)));
    make.Normal(name + inner + ".in_proj_bias", {stacked.shape[0]}, 0.02);
    make.Linear(name + inner + ".out_proj.", {width, width});
    make.Norm(name + "norm.", width);
  };
  for (int i = 0; i < sizes.layers; ++i) {
    const std::string index = fmt::format("{}.", i);
    attention(prefix + "transformer_self_attention_layers." + index, "self_attn");
    attention(prefix + "transformer_cross_attention_layers." + index, "multihead_attn");
    const std::string feed_forward = prefix + "transformer_ffn_layers." + index;
    make.Linear(feed_forward + "linear1.", {sizes.feed_forward, width});
    make.Linear(feed_forward + "linear2.", {width, sizes.feed_forward});
    make.Norm(feed_forward + "norm.", width);
  }
  make.Norm(prefix + "decoder_norm.", width);
}

void AddTower(const std::string& prefix, int64_t width, int layers, Maker& make) {
  for (int i = 0; i < layers; ++i) {
    const std::string name = fmt::format("{}{}.", prefix, i);
    make.Normal(name + "attn.in_proj_weight", {3 * width, width}, 1.5 / std::sqrt(double(width)));
    make.Normal(name + "attn.in_proj_bias", {3 * width}, 0.02);
    make.Linear(name + "attn.out_proj.", {width, width});
    make.Norm(name + "ln_1.", width);
    make.Norm(name + "ln_2.", width);
    make.Linear(name + "mlp.c_fc.", {4 * width, width});
    make.Linear(name + "mlp.c_proj.", {width, 4 * width});
  }
}

}  // namespace

SyntheticDdcolor SyntheticDdcolor::Mini() {
  return {{16, 32, 64, 128}, {1, 1, 2, 1}, 64, 32, 12, 3, 128};
}

WeightMap SyntheticDdcolorWeights(const SyntheticDdcolor& sizes, uint64_t seed) {
  WeightMap weights;
  Maker make(seed, weights);
  make.Fill("mean", {1, 3, 1, 1}, 0.0f).values = {0.485f, 0.456f, 0.406f};
  make.Fill("std", {1, 3, 1, 1}, 0.0f).values = {0.229f, 0.224f, 0.225f};
  ConvNextConfig encoder;
  encoder.stem_kernel = encoder.stem_stride = 4;
  encoder.dims = sizes.dims;
  encoder.depths = sizes.depths;
  for (auto& [name, array] : RandomFeatureWeights(encoder, seed)) {
    weights["encoder.arch." + name] = std::move(array);
  }
  make.Norm("encoder.arch.norm.", sizes.dims.back());
  int64_t in = sizes.dims[3];
  std::vector<int64_t> channels;
  for (int i = 0; i < 3; ++i) {
    const std::string name = fmt::format("decoder.layers.{}.", i);
    const int64_t out = i == 2 ? sizes.decoder_channels / 2 : sizes.decoder_channels;
    const int64_t skip = sizes.dims[2 - i];
    make.Spectral(name + "shuf.conv.0.", {4 * out, in, 1, 1});
    make.BatchNorm(name + "shuf.conv.1.", 4 * out);
    make.BatchNorm(name + "bn.", skip);
    make.Spectral(name + "conv.0.", {out, out + skip, 3, 3});
    make.BatchNorm(name + "conv.2.", out);
    channels.push_back(in = out);
  }
  make.Spectral("decoder.last_shuf.conv.0.", {16 * sizes.query_channels, in, 1, 1});
  make.Normal("decoder.last_shuf.conv.0.bias", {16 * sizes.query_channels}, 0.02);
  AddColorDecoder(sizes, channels, make);
  make.Spectral("refine_net.0.0.", {2, sizes.queries + 3, 1, 1});
  make.Normal("refine_net.0.0.bias", {2}, 0.5);
  return weights;
}

WeightMap SyntheticClipWeights(const SyntheticClip& sizes, uint64_t seed) {
  WeightMap weights;
  Maker make(seed, weights);
  const int64_t width = sizes.width;
  make.Normal("visual.class_embedding", {width}, 0.3);
  make.Normal("visual.positional_embedding", {sizes.grid * sizes.grid + 1, width}, 0.1);
  make.Normal("visual.conv1.weight",
              {width, 3, sizes.patch_px, sizes.patch_px},
              1.0 / (1.7 * sizes.patch_px));
  make.Norm("visual.ln_pre.", width);
  AddTower("visual.transformer.resblocks.", width, sizes.layers, make);
  make.Norm("visual.ln_post.", width);
  make.Normal("visual.proj", {width, sizes.embedding}, 1.0 / std::sqrt(double(width)));
  const int64_t text = sizes.text_width;
  make.Normal("token_embedding.weight", {sizes.vocabulary, text}, 0.3);
  make.Normal("positional_embedding", {sizes.context, text}, 0.1);
  AddTower("transformer.resblocks.", text, sizes.layers, make);
  make.Norm("ln_final.", text);
  make.Normal("text_projection", {text, sizes.embedding}, 1.0 / std::sqrt(double(text)));
  make.Fill("logit_scale", {}, 4.6f);
  return weights;
}

}  // namespace color3d
