#include "core/encoder/clip/clip_network.h"

#include <fmt/core.h>
#include <torch/types.h>

#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/encoder/weight_tensors.h"

namespace color3d {
namespace {

// The weights do not determine the number of heads. All published models have 64 channels per head;
// narrower towers, in tests only, get two heads.
constexpr int64_t kHeadChannels = 64;
constexpr int64_t kHeadsOfNarrowTower = 2;

int64_t HeadCount(int64_t width) {
  const int64_t heads = width >= kHeadChannels ? width / kHeadChannels : kHeadsOfNarrowTower;
  if (width < 1 || width % heads != 0) {
    throw InvalidArgument(
        "the CLIP weights have a tower of {} channels, which cannot be split into heads of 64",
        width);
  }
  return heads;
}

}  // namespace

ClipNetwork::Tower ClipNetwork::TakeTower(WeightReader& reader,
                                          const std::string& prefix,
                                          int64_t width) {
  Tower tower{width, HeadCount(width), {}};
  for (int i = 0;; ++i) {
    const std::string name = fmt::format("{}{}.", prefix, i);
    if (i > 0 && !reader.Has(name + "ln_1.weight")) return tower;
    const int64_t hidden = StoredSize(reader, name + "mlp.c_fc.weight", 0);
    tower.blocks.push_back({TakeLayer(reader, name + "attn.in_proj_", {3 * width, width}),
                            TakeLayer(reader, name + "attn.out_proj.", {width, width}),
                            TakeLayer(reader, name + "ln_1.", {width}),
                            TakeLayer(reader, name + "ln_2.", {width}),
                            TakeLayer(reader, name + "mlp.c_fc.", {hidden, width}),
                            TakeLayer(reader, name + "mlp.c_proj.", {width, hidden})});
  }
}

void ClipNetwork::TakeVision(WeightReader& reader) {
  const int64_t width = StoredSize(reader, "visual.conv1.weight", 0);
  const int64_t patch = StoredSize(reader, "visual.conv1.weight", 2);
  const int64_t cells = StoredSize(reader, "visual.positional_embedding", 0) - 1;
  const int64_t embedding = StoredSize(reader, "visual.proj", 1);
  grid_ = cells > 0 ? static_cast<int>(std::lround(std::sqrt(static_cast<double>(cells)))) : 0;
  if (patch < 1 || patch > 256 || grid_ < 1 || grid_ > 256 ||
      static_cast<int64_t>(grid_) * grid_ != cells) {
    throw InvalidArgument(
        "the CLIP weights describe no square picture: patches of {} px (visual.conv1.weight), {} "
        "positions (visual.positional_embedding)",
        patch,
        cells);
  }
  patch_px_ = static_cast<int>(patch);
  patch_weight_ = TakeTensor(reader, "visual.conv1.weight", {width, 3, patch, patch});
  class_embedding_ = TakeTensor(reader, "visual.class_embedding", {width});
  vision_position_ = TakeTensor(reader, "visual.positional_embedding", {cells + 1, width});
  norm_pre_ = TakeLayer(reader, "visual.ln_pre.", {width});
  vision_ = TakeTower(reader, "visual.transformer.resblocks.", width);
  norm_post_ = TakeLayer(reader, "visual.ln_post.", {width});
  vision_projection_ = TakeTensor(reader, "visual.proj", {width, embedding});
}

void ClipNetwork::TakeText(WeightReader& reader) {
  const int64_t vocabulary = StoredSize(reader, "token_embedding.weight", 0);
  const int64_t width = StoredSize(reader, "token_embedding.weight", 1);
  const int64_t context = StoredSize(reader, "positional_embedding", 0);
  if (context < 2) {
    throw InvalidArgument(
        "the CLIP weights have a text tower of {} positions, but at least two are needed", context);
  }
  token_embedding_ = TakeTensor(reader, "token_embedding.weight", {vocabulary, width});
  text_position_ = TakeTensor(reader, "positional_embedding", {context, width});
  text_ = TakeTower(reader, "transformer.resblocks.", width);
  norm_final_ = TakeLayer(reader, "ln_final.", {width});
  text_projection_ = TakeTensor(reader, "text_projection", {width, vision_projection_.size(1)});
}

ClipNetwork::ClipNetwork(WeightMap weights, bool quick_gelu) : quick_gelu_(quick_gelu) {
  WeightReader reader(std::move(weights), "the CLIP weights");
  TakeVision(reader);
  if (reader.Has("token_embedding.weight")) TakeText(reader);
  // Temperature of the training loss, unused since scores are cosines.
  reader.Ignore("logit_scale");
  reader.Ignore("logit_bias");
  reader.Finish();
}

int ClipNetwork::vocabulary_size() const {
  return HasText() ? static_cast<int>(token_embedding_.size(0)) : 0;
}

int ClipNetwork::context() const {
  return HasText() ? static_cast<int>(text_position_.size(0)) : 0;
}

std::string ClipNetwork::ToString() const {
  return fmt::format("ViT of width {}, {} layers, patches of {} px in {} px, {}{}",
                     vision_.width,
                     vision_.blocks.size(),
                     patch_px_,
                     input_side_px(),
                     quick_gelu_ ? "QuickGELU" : "GELU",
                     HasText() ? "" : ", no text tower");
}

torch::Tensor ClipNetwork::RunBlock(const Tower& tower,
                                    const Block& block,
                                    const torch::Tensor& x,
                                    bool causal) const {
  const int64_t batch = x.size(0);
  const int64_t count = x.size(1);
  const int64_t head_width = tower.width / tower.heads;
  const torch::Tensor qkv = block.in.Linear(block.norm1.Norm(x))
                                .view({batch, count, 3, tower.heads, head_width})
                                .permute({2, 0, 3, 1, 4});  // [3,B,heads,N,head_width]
  const double scale = 1.0 / std::sqrt(static_cast<double>(head_width));
  torch::Tensor scores = torch::matmul(qkv[0] * scale, qkv[1].transpose(-2, -1));
  if (causal) {
    scores = scores + torch::full({count, count}, -INFINITY).triu(1);
  }
  const torch::Tensor mixed = torch::matmul(scores.softmax(-1), qkv[2]).transpose(1, 2).flatten(2);
  const torch::Tensor y = x + block.out.Linear(mixed);
  torch::Tensor hidden = block.expand.Linear(block.norm2.Norm(y));
  hidden = quick_gelu_ ? hidden * torch::sigmoid(1.702 * hidden) : torch::gelu(hidden);
  return y + block.contract.Linear(hidden);
}

torch::Tensor ClipNetwork::RunVision(const torch::Tensor& rgb, int left_out) const {
  const torch::Tensor mean =
      torch::tensor({0.48145466f, 0.4578275f, 0.40821073f}).view({1, 3, 1, 1});
  const torch::Tensor deviation =
      torch::tensor({0.26862954f, 0.26130258f, 0.27577711f}).view({1, 3, 1, 1});
  const torch::Tensor patches =
      torch::conv2d((rgb - mean) / deviation, patch_weight_, {}, /*stride=*/patch_px_)
          .flatten(2)
          .transpose(1, 2);  // [B, grid^2, width]
  const torch::Tensor first = class_embedding_.view({1, 1, -1}).expand({rgb.size(0), 1, -1});
  torch::Tensor x = torch::cat({first, patches}, 1) + vision_position_;
  x = norm_pre_.Norm(x);
  for (size_t i = 0; i + left_out < vision_.blocks.size(); ++i) {
    x = RunBlock(vision_, vision_.blocks[i], x, /*causal=*/false);
  }
  return x;
}

torch::Tensor ClipNetwork::EncodeImages(const torch::Tensor& rgb) const {
  const torch::Tensor first = RunVision(rgb, /*left_out=*/0).select(1, 0);
  return torch::mm(norm_post_.Norm(first), vision_projection_);
}

torch::Tensor ClipNetwork::EncodePatches(const torch::Tensor& rgb) const {
  const torch::Tensor x = RunVision(rgb, /*left_out=*/1).slice(1, 1);
  const Block& last = vision_.blocks.back();
  const torch::Tensor values = torch::linear(last.norm1.Norm(x),
                                             last.in.weight.slice(0, 2 * vision_.width),
                                             last.in.bias.slice(0, 2 * vision_.width));
  const torch::Tensor y = last.out.Linear(values);
  const torch::Tensor features = torch::matmul(norm_post_.Norm(y), vision_projection_);
  return features.transpose(1, 2).reshape({rgb.size(0), -1, grid_, grid_});
}

torch::Tensor ClipNetwork::EncodeTokens(const torch::Tensor& tokens) const {
  const int64_t count = tokens.size(1);
  torch::Tensor x = torch::embedding(token_embedding_, tokens) + text_position_.slice(0, 0, count);
  for (const Block& block : text_.blocks) x = RunBlock(text_, block, x, /*causal=*/true);
  x = norm_final_.Norm(x);
  const torch::Tensor rows = torch::arange(tokens.size(0), torch::kInt64);
  const torch::Tensor ends = x.index({rows, tokens.argmax(1)});
  return torch::mm(ends, text_projection_);
}

}  // namespace color3d
