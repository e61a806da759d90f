// CLIP with a vision transformer, from published weights that the user provides: descriptors for
// key view selection, dense features and text features for `prompt`, and the CLIP score. Immutable,
// thread-safe. No torch in this interface.
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

// Locates phrases in a picture. An interface, so that tests can replace CLIP.
class TextImageModel {
 public:
  virtual ~TextImageModel() = default;
  // Returns features on a coarse grid over the picture (3 channels sRGB, stretched to the model's
  // square): one plane per feature, not normalised.
  virtual Image PatchFeatures(const Image& srgb) const = 0;
  // Returns the feature of a text in the same space, not normalised.
  virtual std::vector<float> TextFeatures(const std::string& text) const = 0;
};

struct ClipScore {
  double cosine = 0.0;  // raw
  double score = 0.0;   // 2.5 * max(cosine, 0) (Hessel et al. 2021)
};

class ClipModel : public Encoder, public TextImageModel {
 public:
  // Reads the vocabulary from a file beside the weights: bpe_simple_vocab_16e6.txt[.gz] or
  // merges.txt; without it only pictures can be encoded. The activation of the feed-forward layers
  // is read from config.json or open_clip_config.json beside the weights (most models of open_clip
  // have the exact GELU); without these files it is OpenAI's QuickGELU. Throws
  // Error{kInvalidArgument} listing weights that are missing, unexpected or misshapen, or naming
  // the fault of the vocabulary.
  static std::shared_ptr<const ClipModel> FromWeightFile(const std::filesystem::path& path);
  // `weights` in OpenAI's or Hugging Face's layout.
  ClipModel(WeightMap weights, bool quick_gelu);
  ~ClipModel() override;
  void LoadVocabulary(const std::filesystem::path& path);

  const std::string& digest() const override { return digest_; }
  const std::string& description() const override { return description_; }
  // Returns image features of the grey picture of L, normalised.
  std::vector<double> Describe(const Image& luminance) const override;
  // Returns PatchFeatures of the grey picture of L.
  Image DeepFeatures(const Image& luminance) const override;

  // Returns the feature of a picture (1 or 3 channels, sRGB) by the published preprocessing:
  // shorter side scaled to the model's size, antialiased bicubic, then centre crop.
  std::vector<float> ImageFeatures(const Image& srgb) const;
  Image PatchFeatures(const Image& srgb) const override;
  // Throws Error{kFailedPrecondition} if there is no text tower or no vocabulary.
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
