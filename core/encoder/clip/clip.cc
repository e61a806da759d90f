#include "core/encoder/clip/clip.h"

#include <torch/types.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/encoder/clip/clip_network.h"
#include "core/encoder/clip/clip_weights.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_errors.h"
#include "core/encoder/weight_digest.h"
#include "core/image/image_checks.h"
#include "core/weights/weight_file.h"

namespace color3d {
namespace {

constexpr const char* kVocabularyNames[] = {
    "bpe_simple_vocab_16e6.txt.gz", "bpe_simple_vocab_16e6.txt", "merges.txt"};
constexpr int64_t kMaxConfigBytes = 1 << 20;

// [1,3,H,W] of a picture with 1 or 3 channels.
torch::Tensor RgbTensor(const Image& srgb) {
  if (srgb.Empty() || (srgb.channels != 1 && srgb.channels != 3)) {
    throw InvalidArgument("CLIP takes a picture with 1 or 3 channels, but got {}", srgb.channels);
  }
  return TensorFromImage(srgb).expand({1, 3, srgb.height, srgb.width}).contiguous();
}

// Bicubic with antialiasing, as in the authors' preprocessing. Overshoot is clipped, as in their
// 8-bit pictures.
torch::Tensor ResizeBicubic(const torch::Tensor& rgb, int64_t height, int64_t width) {
  if (rgb.size(2) == height && rgb.size(3) == width) return rgb;
  return at::_upsample_bicubic2d_aa(rgb, {height, width}, /*align_corners=*/false).clamp(0.0, 1.0);
}

// Scales the shorter side to `side`, then crops the central square.
torch::Tensor CenterSquare(const torch::Tensor& rgb, int64_t side) {
  const int64_t height = rgb.size(2);
  const int64_t width = rgb.size(3);
  const int64_t shorter = std::min(height, width);
  // The longer side is rounded down, the cut to the nearest even number, as in the publication.
  const torch::Tensor resized = ResizeBicubic(rgb, side * height / shorter, side * width / shorter);
  const auto top = static_cast<int64_t>(std::nearbyint((resized.size(2) - side) / 2.0));
  const auto left = static_cast<int64_t>(std::nearbyint((resized.size(3) - side) / 2.0));
  return resized.slice(2, top, top + side).slice(3, left, left + side).contiguous();
}

Image GrayPicture(const Image& luminance) {
  RequireLuminance(luminance, "the encoder");
  return SrgbFromLab(luminance);
}

double Norm(const std::vector<float>& values) {
  double sum = 0.0;
  for (const float value : values) sum += static_cast<double>(value) * value;
  return std::sqrt(std::max(sum, 1e-30));
}

// Reads config.json (Hugging Face) or open_clip_config.json beside the weights.
bool UsesQuickGelu(const std::filesystem::path& weights) {
  for (const char* name : {"open_clip_config.json", "config.json"}) {
    const std::filesystem::path path = weights.parent_path() / name;
    if (!std::filesystem::is_regular_file(path)) continue;
    const auto config = nlohmann::json::parse(ReadFile(path, kMaxConfigBytes), nullptr, false);
    if (!config.is_object()) continue;
    const auto model = config.value("model_cfg", nlohmann::json::object());
    if (model.is_object() && !model.empty()) {
      const auto quick = model.find("quick_gelu");
      return quick != model.end() && quick->is_boolean() && quick->get<bool>();
    }
    for (const auto& part : {config, config.value("vision_config", nlohmann::json::object())}) {
      const auto activation = part.is_object() ? part.find("hidden_act") : part.end();
      if (activation != part.end() && activation->is_string()) {
        return activation->get<std::string>() == "quick_gelu";
      }
    }
  }
  return true;
}

}  // namespace

ClipModel::ClipModel(WeightMap weights, bool quick_gelu) {
  WeightMap canonical = OpenAiClipWeights(std::move(weights));
  digest_ = DigestOfWeights(quick_gelu ? "CLIP, QuickGELU" : "CLIP, GELU", canonical);
  WithTorchErrors("CLIP", [&] {
    at::NoGradGuard no_grad;
    network_ = std::make_unique<const ClipNetwork>(std::move(canonical), quick_gelu);
  });
  description_ = "CLIP, " + network_->ToString();
}

ClipModel::~ClipModel() = default;

void ClipModel::LoadVocabulary(const std::filesystem::path& path) {
  if (!network_->HasText()) {
    throw Error(ErrorCode::kFailedPrecondition, "these CLIP weights have no text tower");
  }
  tokenizer_ = ClipTokenizer::FromFile(path, network_->vocabulary_size());
}

std::shared_ptr<const ClipModel> ClipModel::FromWeightFile(const std::filesystem::path& path) {
  WeightMap weights = ReadWeightFile(path);
  if (!HoldsClip(weights)) {
    throw InvalidArgument(
        "{} contains no CLIP model with a ViT (it has {} arrays, none called "
        "visual.class_embedding)",
        path.string(),
        weights.size());
  }
  const auto model = std::make_shared<ClipModel>(std::move(weights), UsesQuickGelu(path));
  if (!model->network_->HasText()) return model;
  for (const char* name : kVocabularyNames) {
    const std::filesystem::path vocabulary = path.parent_path() / name;
    if (!std::filesystem::is_regular_file(vocabulary)) continue;
    model->LoadVocabulary(vocabulary);
    break;
  }
  return model;
}

std::vector<double> ClipModel::Describe(const Image& luminance) const {
  const std::vector<float> features = ImageFeatures(GrayPicture(luminance));
  const double norm = Norm(features);
  std::vector<double> described;
  for (const float value : features) described.push_back(value / norm);
  return described;
}

Image ClipModel::DeepFeatures(const Image& luminance) const {
  return PatchFeatures(GrayPicture(luminance));
}

std::vector<float> ClipModel::ImageFeatures(const Image& srgb) const {
  const torch::Tensor rgb = RgbTensor(srgb);
  return WithTorchErrors("CLIP", [&] {
    at::NoGradGuard no_grad;
    return TensorValues(network_->EncodeImages(CenterSquare(rgb, network_->input_side_px())));
  });
}

Image ClipModel::PatchFeatures(const Image& srgb) const {
  const torch::Tensor rgb = RgbTensor(srgb);
  return WithTorchErrors("CLIP", [&] {
    at::NoGradGuard no_grad;
    const int side = network_->input_side_px();
    return ImageFromTensor(network_->EncodePatches(ResizeBicubic(rgb, side, side)));
  });
}

std::vector<int64_t> ClipModel::Tokens(const std::string& text) const {
  if (!network_->HasText()) {
    throw Error(ErrorCode::kFailedPrecondition, "these CLIP weights have no text tower");
  }
  if (!tokenizer_) {
    throw Error(ErrorCode::kFailedPrecondition,
                "CLIP needs its vocabulary to read text: put bpe_simple_vocab_16e6.txt.gz or "
                "merges.txt beside the weight file");
  }
  return tokenizer_->Tokens(text, network_->context());
}

std::vector<float> ClipModel::TextFeatures(const std::string& text) const {
  return TextFeaturesOfTokens(Tokens(text));
}

std::vector<float> ClipModel::TextFeaturesOfTokens(const std::vector<int64_t>& tokens) const {
  const auto known = [&](int64_t token) {
    return token >= 0 && token < network_->vocabulary_size();
  };
  if (tokens.empty() || tokens.size() > static_cast<size_t>(network_->context()) ||
      !std::all_of(tokens.begin(), tokens.end(), known)) {
    throw InvalidArgument("CLIP takes 1 to {} tokens below {}, not these {}",
                          network_->context(),
                          network_->vocabulary_size(),
                          tokens.size());
  }
  return WithTorchErrors("CLIP", [&] {
    at::NoGradGuard no_grad;
    return TensorValues(network_->EncodeTokens(torch::tensor(tokens, torch::kInt64).unsqueeze(0)));
  });
}

ClipScore ClipModel::Score(const Image& srgb, const std::string& text) const {
  const std::vector<float> image = ImageFeatures(srgb);
  const std::vector<float> words = TextFeatures(text);
  double dot = 0.0;
  for (size_t i = 0; i < image.size(); ++i) dot += static_cast<double>(image[i]) * words[i];
  const double cosine = dot / (Norm(image) * Norm(words));
  return {cosine, 2.5 * std::max(cosine, 0.0)};
}

}  // namespace color3d
