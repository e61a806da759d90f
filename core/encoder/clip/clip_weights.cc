#include "core/encoder/clip/clip_weights.h"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace color3d {
namespace {

struct Renaming {
  std::string_view from;
  std::string_view to;
};

// Full names, or prefixes that end in a dot.
constexpr Renaming kOutside[] = {
    {"vision_model.embeddings.class_embedding", "visual.class_embedding"},
    {"vision_model.embeddings.position_embedding.weight", "visual.positional_embedding"},
    {"vision_model.embeddings.patch_embedding.weight", "visual.conv1.weight"},
    {"vision_model.pre_layrnorm.", "visual.ln_pre."},
    {"vision_model.pre_layernorm.", "visual.ln_pre."},
    {"vision_model.post_layernorm.", "visual.ln_post."},
    {"text_model.embeddings.token_embedding.weight", "token_embedding.weight"},
    {"text_model.embeddings.position_embedding.weight", "positional_embedding"},
    {"text_model.final_layer_norm.", "ln_final."},
};
constexpr Renaming kTowers[] = {
    {"vision_model.encoder.layers.", "visual.transformer.resblocks."},
    {"text_model.encoder.layers.", "transformer.resblocks."},
};
// Names after "<tower><number>.".
constexpr Renaming kInBlock[] = {
    {"self_attn.out_proj.", "attn.out_proj."},
    {"layer_norm1.", "ln_1."},
    {"layer_norm2.", "ln_2."},
    {"mlp.fc1.", "mlp.c_fc."},
    {"mlp.fc2.", "mlp.c_proj."},
};

bool Rename(const Renaming& rule, std::string_view name, std::string& renamed) {
  const bool whole = !rule.from.ends_with('.');
  if (whole ? name != rule.from : !name.starts_with(rule.from)) return false;
  renamed = std::string(rule.to) + std::string(name.substr(rule.from.size()));
  return true;
}

// Returns the length of "<number>." at the start of `rest`, or 0 if there is none.
size_t NumberLength(std::string_view rest) {
  const size_t digits = rest.find_first_not_of("0123456789");
  return digits != std::string_view::npos && digits > 0 && rest[digits] == '.' ? digits + 1 : 0;
}

std::string OpenAiName(const std::string& name) {
  std::string renamed = name;
  for (const Renaming& rule : kOutside) {
    if (Rename(rule, name, renamed)) return renamed;
  }
  for (const Renaming& tower : kTowers) {
    std::string inside;
    if (!Rename(tower, name, inside)) continue;
    const size_t number = tower.to.size();
    const size_t length = NumberLength(std::string_view(inside).substr(number));
    const std::string rest = inside.substr(number + length);
    for (const Renaming& rule : kInBlock) {
      if (length > 0 && Rename(rule, rest, renamed)) {
        return inside.substr(0, number + length) + renamed;
      }
    }
    return inside;
  }
  return name;
}

// Transposes a matrix.
WeightArray Transposed(const WeightArray& array) {
  if (array.shape.size() != 2) return array;
  const size_t rows = static_cast<size_t>(array.shape[0]);
  const size_t columns = static_cast<size_t>(array.shape[1]);
  WeightArray out{{array.shape[1], array.shape[0]}, std::vector<float>(array.values.size())};
  for (size_t r = 0; r < rows; ++r) {
    for (size_t c = 0; c < columns; ++c) out.values[c * rows + r] = array.values[r * columns + c];
  }
  return out;
}

// Replaces "<prefix>self_attn.{q,k,v}_proj.<kind>" by "<prefix>attn.in_proj_<kind>" if all three
// exist with equal shapes. Otherwise they are kept, so that the network lists them.
void StackAttention(const std::string& prefix, const std::string& kind, WeightMap& weights) {
  std::vector<WeightMap::iterator> parts;
  for (const char* part : {"q", "k", "v"}) {
    const auto found = weights.find(prefix + "self_attn." + part + "_proj." + kind);
    if (found == weights.end() || found->second.shape.empty()) return;
    if (!parts.empty() && found->second.shape != parts[0]->second.shape) return;
    parts.push_back(found);
  }
  WeightArray stacked{parts[0]->second.shape, {}};
  stacked.shape[0] *= 3;
  for (const auto& part : parts) {
    stacked.values.insert(
        stacked.values.end(), part->second.values.begin(), part->second.values.end());
    weights.erase(part);
  }
  weights[prefix + "attn.in_proj_" + kind] = std::move(stacked);
}

WeightMap FromHuggingFace(WeightMap weights) {
  WeightMap renamed;
  while (!weights.empty()) {
    auto node = weights.extract(weights.begin());
    if (node.key().ends_with(".position_ids")) continue;
    if (node.key() == "visual_projection.weight" || node.key() == "text_projection.weight") {
      renamed[node.key().starts_with("visual") ? "visual.proj" : "text_projection"] =
          Transposed(node.mapped());
      continue;
    }
    node.key() = OpenAiName(node.key());
    renamed.insert(std::move(node));
  }
  std::vector<std::string> blocks;
  constexpr std::string_view kQuery = "self_attn.q_proj.weight";
  for (const auto& [name, array] : renamed) {
    if (name.ends_with(kQuery)) blocks.push_back(name.substr(0, name.size() - kQuery.size()));
  }
  for (const std::string& prefix : blocks) {
    StackAttention(prefix, "weight", renamed);
    StackAttention(prefix, "bias", renamed);
  }
  return renamed;
}

}  // namespace

bool HoldsClip(const WeightMap& weights) {
  return weights.count("visual.class_embedding") > 0 || weights.count("visual.proj") > 0 ||
         weights.count("visual.attnpool.positional_embedding") > 0 ||
         weights.count("vision_model.embeddings.class_embedding") > 0;
}

WeightMap OpenAiClipWeights(WeightMap weights) {
  if (weights.count("visual.attnpool.positional_embedding") > 0) {
    throw InvalidArgument(
        "this CLIP has a ResNet as image tower, which is not supported; give one with a ViT, such "
        "as ViT-B/32");
  }
  const bool hugging_face = weights.count("vision_model.embeddings.class_embedding") > 0;
  if (hugging_face) return FromHuggingFace(std::move(weights));
  for (const char* buffer : {"input_resolution", "context_length", "vocab_size", "attn_mask"}) {
    weights.erase(buffer);
  }
  std::erase_if(weights, [](const auto& item) {
    return item.first.ends_with(".attn_mask") || item.first == "visual.input_resolution";
  });
  return weights;
}

}  // namespace color3d
