// color3d-bench golden: compares a published network with outputs of its authors' code.
#include <fmt/core.h>
#include <torch/types.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/encoder/clip/clip.h"
#include "core/encoder/clip/clip_weights.h"
#include "core/encoder/convnext/convnext.h"
#include "core/encoder/image_tensors.h"
#include "core/keycolor/automatic/ddcolor.h"
#include "core/weights/weight_file.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"

namespace color3d {
namespace {

struct GoldenArguments {
  std::string weights_file;
  std::string expected_file;
  std::string vocabulary;
  std::string json_file;
  double tolerance = 1e-4;
};

// Compares tensors. The relative error of a tensor is its largest deviation over its
// largest expected magnitude.
class Comparison {
 public:
  explicit Comparison(WeightMap expected) : expected_(std::move(expected)) {}

  bool Has(const std::string& name) const { return expected_.count(name) > 0; }
  const WeightArray& Expected(const std::string& name) const {
    const auto found = expected_.find(name);
    if (found == expected_.end()) {
      throw InvalidArgument("the file of expected outputs has no \"{}\"", name);
    }
    return found->second;
  }
  void Add(const std::string& name, const std::vector<float>& values) {
    const std::vector<float>& expected = Expected(name).values;
    double worst = values.size() == expected.size() ? 0.0 : std::numeric_limits<double>::infinity();
    double largest = 0.0;
    for (size_t i = 0; i < std::min(values.size(), expected.size()); ++i) {
      const double difference = std::abs(static_cast<double>(values[i]) - expected[i]);
      worst = std::max(worst, std::isfinite(difference) ? difference : INFINITY);
      largest = std::max<double>(largest, std::abs(expected[i]));
    }
    errors_.emplace_back(name, worst / std::max(largest, 1e-30));
  }
  const std::vector<std::pair<std::string, double>>& errors() const { return errors_; }

 private:
  WeightMap expected_;
  std::vector<std::pair<std::string, double>> errors_;
};

std::vector<float> ValuesOf(const torch::Tensor& tensor) {
  const torch::Tensor flat = tensor.contiguous().flatten();
  return {flat.data_ptr<float>(), flat.data_ptr<float>() + flat.numel()};
}

// Picture `index` of an array [N,3,H,W].
Image PictureOf(const WeightArray& array, int64_t index) {
  if (array.shape.size() != 4 || array.shape[1] != 3 || index >= array.shape[0]) {
    throw InvalidArgument("the pictures in the file of expected outputs are not [N,3,H,W]");
  }
  Image image(static_cast<int>(array.shape[3]), static_cast<int>(array.shape[2]), 3);
  std::copy_n(array.values.begin() + index * static_cast<int64_t>(image.data.size()),
              image.data.size(),
              image.data.begin());
  return image;
}

void CompareDdcolor(WeightMap weights, Comparison& comparison) {
  const Ddcolor network(std::move(weights));
  const Image input = PictureOf(comparison.Expected("input"), 0);
  at::NoGradGuard no_grad;
  const torch::Tensor normalized = ConvNext::NormalizeInput(TensorFromImage(input));
  const std::vector<torch::Tensor> stages = network.encoder().StageOutputs(normalized, 4);
  const std::vector<torch::Tensor> taps = network.encoder().Taps(normalized);
  for (int i = 0; i < 4; ++i) {
    comparison.Add(fmt::format("stage{}", i), ValuesOf(stages[i]));
    comparison.Add(fmt::format("norm{}", i), ValuesOf(taps[i]));
  }
  comparison.Add("ab", network.Predict(input).data);
}

std::vector<float> AsFloats(const std::vector<int64_t>& values) {
  return {values.begin(), values.end()};
}

void Normalize(std::vector<float>& feature) {
  double sum = 0.0;
  for (const float value : feature) sum += static_cast<double>(value) * value;
  for (float& value : feature) value = static_cast<float>(value / std::sqrt(sum));
}

// Returns which part was not compared; empty: none.
std::string CompareClip(WeightMap weights,
                        const GoldenArguments& args,
                        const WeightMetadata& metadata,
                        Comparison& comparison) {
  ClipModel clip(std::move(weights), /*quick_gelu=*/true);
  const WeightArray& pictures = comparison.Expected("image");
  const WeightArray& tokens = comparison.Expected("tokens");
  if (tokens.shape.size() != 2) throw InvalidArgument("the expected tokens are not [N,context]");
  std::vector<std::vector<float>> images, texts;
  std::vector<float> all_images, all_texts, cosine;
  for (int64_t i = 0; i < pictures.shape.at(0); ++i) {
    images.push_back(clip.ImageFeatures(PictureOf(pictures, i)));
    all_images.insert(all_images.end(), images.back().begin(), images.back().end());
    Normalize(images.back());
  }
  for (int64_t i = 0; i < tokens.shape[0]; ++i) {
    const auto begin = tokens.values.begin() + i * tokens.shape[1];
    texts.push_back(
        clip.TextFeaturesOfTokens(std::vector<int64_t>(begin, begin + tokens.shape[1])));
    all_texts.insert(all_texts.end(), texts.back().begin(), texts.back().end());
    Normalize(texts.back());
  }
  for (const auto& image : images) {
    for (const auto& text : texts) {
      double dot = 0.0;
      for (size_t i = 0; i < image.size(); ++i) dot += static_cast<double>(image[i]) * text[i];
      cosine.push_back(static_cast<float>(dot));
    }
  }
  comparison.Add("image_features", all_images);
  comparison.Add("text_features", all_texts);
  comparison.Add("cosine", cosine);
  const auto prompts = metadata.find("prompts");
  if (args.vocabulary.empty() || prompts == metadata.end()) {
    return "tokens: not compared, give --vocabulary (and prompts in the expected file's metadata)";
  }
  clip.LoadVocabulary(args.vocabulary);
  const nlohmann::json list = nlohmann::json::parse(prompts->second, nullptr, false);
  std::vector<float> all_tokens;
  for (const nlohmann::json& prompt : list) {
    if (!prompt.is_string()) {
      throw InvalidArgument(
          "\"prompts\" in the file of expected outputs is not a JSON list of strings");
    }
    const std::vector<float> ours = AsFloats(clip.Tokens(prompt.get<std::string>()));
    all_tokens.insert(all_tokens.end(), ours.begin(), ours.end());
  }
  comparison.Add("tokens", all_tokens);
  return "";
}

int RunGolden(const GoldenArguments& args) {
  WeightMetadata metadata;
  Comparison comparison(ReadWeightFile(args.expected_file, &metadata));
  WeightMap weights = ReadWeightFile(args.weights_file);
  std::string network;
  std::string skipped;
  if (Ddcolor::Recognizes(weights)) {
    network = "DDColor";
    CompareDdcolor(std::move(weights), comparison);
  } else if (HoldsClip(weights)) {
    network = "CLIP";
    skipped = CompareClip(std::move(weights), args, metadata, comparison);
  } else {
    throw InvalidArgument("{} holds neither a DDColor nor a CLIP", args.weights_file);
  }
  nlohmann::ordered_json result{{"network", network}, {"tolerance", args.tolerance}};
  double worst = 0.0;
  for (const auto& [name, error] : comparison.errors()) {
    std::printf("%-16s %.3e\n", name.c_str(), error);
    result["relative_error"][name] = error;
    worst = std::max(worst, error);
  }
  if (!skipped.empty()) std::printf("%s\n", skipped.c_str());
  const bool within = worst <= args.tolerance;
  std::printf("%s: worst relative error %.3e, %s %.1e\n",
              network.c_str(),
              worst,
              within ? "within" : "NOT within",
              args.tolerance);
  result["worst"] = worst;
  result["not_compared"] = skipped;
  result["within"] = within;
  if (!args.json_file.empty()) WriteResult(result, args.json_file);
  return within ? 0 : 1;
}

}  // namespace

void AddGoldenCommand(CLI::App& app) {
  auto args = std::make_shared<GoldenArguments>();
  CLI::App* command = app.add_subcommand(
      "golden", "Compare a DDColor or CLIP weight file with outputs of its authors' code");
  command->add_option("--weights", args->weights_file, "Weight file")->required();
  command->add_option("--expected", args->expected_file, "Expected outputs (safetensors)")
      ->required();
  command->add_option(
      "--vocabulary", args->vocabulary, "Vocabulary of CLIP, to compare the tokens, too");
  command->add_option("--tolerance",
                      args->tolerance,
                      "Maximum deviation, relative to the largest expected value; half-precision "
                      "copies of float32 weights need about 1e-2");
  command->add_option(
      "--json", args->json_file, "File for the result (JSON); default: standard output");
  command->callback([args] {
    if (RunGolden(*args) != 0) throw CLI::RuntimeError(1);
  });
}

}  // namespace color3d
