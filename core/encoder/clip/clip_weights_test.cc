#include "core/encoder/clip/clip_weights.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/encoder/clip/clip.h"
#include "tests/support/networks/synthetic_networks.h"

namespace color3d {
namespace {

Image RandomPicture(int width, int height) {
  Random random(3);
  Image image(width, height, 3);
  for (float& value : image.data) value = static_cast<float>(random.NextUniform());
  return image;
}

void Replace(std::string& name, const std::string& from, const std::string& to) {
  const size_t at = name.find(from);
  if (at != std::string::npos) name.replace(at, from.size(), to);
}

WeightArray Transposed(const WeightArray& a) {
  WeightArray t{{a.shape[1], a.shape[0]}, std::vector<float>(a.values.size())};
  for (int64_t r = 0; r < a.shape[0]; ++r) {
    for (int64_t c = 0; c < a.shape[1]; ++c) {
      t.values[c * a.shape[0] + r] = a.values[r * a.shape[1] + c];
    }
  }
  return t;
}

// Converts OpenAI's layout to that of Hugging Face.
WeightMap HuggingFaceLayout(const WeightMap& openai) {
  WeightMap out;
  for (const auto& [openai_name, array] : openai) {
    std::string name = openai_name;
    if (name == "visual.proj") {
      out["visual_projection.weight"] = Transposed(array);
      continue;
    }
    if (name == "text_projection") {
      out["text_projection.weight"] = Transposed(array);
      continue;
    }
    if (name == "positional_embedding") name = "text_model.embeddings.position_embedding.weight";
    Replace(
        name, "visual.positional_embedding", "vision_model.embeddings.position_embedding.weight");
    Replace(name, "visual.class_embedding", "vision_model.embeddings.class_embedding");
    Replace(name, "visual.conv1.weight", "vision_model.embeddings.patch_embedding.weight");
    Replace(name, "visual.ln_pre", "vision_model.pre_layrnorm");
    Replace(name, "visual.ln_post", "vision_model.post_layernorm");
    Replace(name, "visual.transformer.resblocks", "vision_model.encoder.layers");
    if (name.starts_with("transformer")) {
      Replace(name, "transformer.resblocks", "text_model.encoder.layers");
    }
    if (name == "token_embedding.weight") name = "text_model.embeddings.token_embedding.weight";
    Replace(name, "ln_final", "text_model.final_layer_norm");
    Replace(name, "attn.out_proj", "self_attn.out_proj");
    Replace(name, "ln_1", "layer_norm1");
    Replace(name, "ln_2", "layer_norm2");
    Replace(name, "mlp.c_fc", "mlp.fc1");
    Replace(name, "mlp.c_proj", "mlp.fc2");
    const size_t stacked = name.find("attn.in_proj_");
    if (stacked == std::string::npos) {
      out[name] = array;
      continue;
    }
    const std::string kind = name.substr(stacked + 13);
    const size_t third = array.values.size() / 3;
    for (int i = 0; i < 3; ++i) {
      WeightArray part{array.shape, {}};
      part.shape[0] /= 3;
      part.values.assign(array.values.begin() + i * third, array.values.begin() + (i + 1) * third);
      out[name.substr(0, stacked) + "self_attn." + "qkv"[i] + "_proj." + kind] = part;
    }
  }
  out["text_model.embeddings.position_ids"] = {{1, 2}, {0.0f, 1.0f}};
  return out;
}

TEST(ClipWeightsTest, ReadsBothLayoutsAsSameModel) {
  const WeightMap openai = SyntheticClipWeights({}, 7);
  const WeightMap other = HuggingFaceLayout(openai);
  ASSERT_TRUE(HoldsClip(openai));
  ASSERT_TRUE(HoldsClip(other));
  EXPECT_EQ(other.count("vision_model.encoder.layers.1.self_attn.k_proj.bias"), 1u);
  const ClipModel a(openai, true);
  const ClipModel b(other, true);
  EXPECT_EQ(a.digest(), b.digest());
  const Image picture = RandomPicture(64, 64);
  EXPECT_EQ(a.ImageFeatures(picture), b.ImageFeatures(picture));
}

TEST(ClipWeightsTest, NamesArraysThatDoNotFit) {
  WeightMap missing = SyntheticClipWeights({}, 7);
  missing.erase("visual.ln_post.bias");
  missing["visual.odd"] = {{2}, {0.0f, 0.0f}};
  missing["ln_final.weight"] = {{2}, {1.0f, 1.0f}};
  try {
    const ClipModel model(missing, true);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("visual.ln_post.bias"));
    EXPECT_THAT(error.what(), testing::HasSubstr("visual.odd"));
    EXPECT_THAT(error.what(), testing::HasSubstr("ln_final.weight"));
  }
  WeightMap resnet;
  resnet["visual.attnpool.positional_embedding"] = {{1}, {0.0f}};
  EXPECT_THROW(ClipModel(resnet, true), Error);
}

TEST(ClipWeightsTest, ListsIncompleteAttentionStack) {
  WeightMap other = HuggingFaceLayout(SyntheticClipWeights({}, 7));
  other.erase("vision_model.encoder.layers.0.self_attn.k_proj.weight");
  try {
    const ClipModel model(other, true);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("attn.in_proj_weight"));
    EXPECT_THAT(error.what(), testing::HasSubstr("q_proj"));
  }
}

}  // namespace
}  // namespace color3d
