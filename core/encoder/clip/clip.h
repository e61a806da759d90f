// CLIP with a vision transformer, from the user's published weights: descriptors for key view
// selection, dense features and text features for `prompt`, and the CLIP score. Immutable after
// construction, thread-safe. No torch in this interface.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/encoder/clip/clip_tokenizer.h"
#include "core/encoder/encoder.h"
#include "core/weights/weight_map.h"

namespace color3d {

class ClipNetwork;

// What tells where in a picture a phrase is; an interface so that tests can stand in for CLIP.
class TextImageModel {
 public:
  virtual ~TextImageModel() = default;
  // Features of a coarse grid over the picture (3 channels sRGB, stretched to the model's square):
  // one plane per feature, not normalised.
  virtual Image PatchFeatures(const Image& srgb) const = 0;
  // Feature of a text in the same space, not normalised.
  virtual std::vector<float> TextFeatures(const std::string& text) const = 0;
};

struct ClipScore {
  double cosine = 0.0;  // raw
  double score = 0.0;   // 2.5 * max(cosine, 0) (Hessel et al. 2021)
};

class ClipModel : public Encoder, public TextImageModel {
 public:
  // The vocabulary is read from beside the weights: bpe_simple_vocab_16e6.txt[.gz] or merges.txt;
  // without one only pictures can be encoded. What the feed-forward layers use cannot be told from
  // the weights either: config.json or open_clip_config.json beside them says it (models of
  // open_clip mostly have the plain GELU); without one it is QuickGELU, OpenAI's. Throws
  // Error{kInvalidArgument} listing the weights that are missing, unexpected or misshapen, or
  // naming what is wrong with the vocabulary.
  static std::shared_ptr<const ClipModel> FromWeightFile(const std::filesystem::path& path);
  // `weights` in OpenAI's or Hugging Face's layout.
  ClipModel(WeightMap weights, bool quick_gelu);
  ~ClipModel() override;
  void LoadVocabulary(const std::filesystem::path& path);

  const std::string& digest() const override { return digest_; }
  const std::string& description() const override { return description_; }
  // Image features of the grey picture of L, normalised.
  std::vector<double> Describe(const Image& luminance) const override;
  // PatchFeatures of the grey picture of L.
  Image DeepFeatures(const Image& luminance) const override;

  // Feature of a picture (1 or 3 channels, sRGB), by the published preprocessing: shorter side to
  // the model's, antialiased bicubic, centre cut out.
  std::vector<float> ImageFeatures(const Image& srgb) const;
  Image PatchFeatures(const Image& srgb) const override;
  // Throws Error{kFailedPrecondition} without a text tower or a vocabulary.
  std::vector<float> TextFeatures(const std::string& text) const override;
  std::vector<int64_t> Tokens(const std::string& text) const;
  std::vector<float> TextFeaturesOfTokens(const std::vector<int64_t>& tokens) const;
  ClipScore Score(const Image& srgb, const std::string& text) const;

 private:
  std::unique_ptr<const ClipNetwork> network_;
  std::optional<ClipTokenizer> tokenizer_;
  std::string digest_;
  std::string description_;
};

}  // namespace color3d
