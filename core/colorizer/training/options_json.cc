#include "core/colorizer/training/options_json.h"

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace color3d {
namespace {

template <typename T>
using Names = std::vector<std::pair<T, const char*>>;

// Names in colorizer files. They must not change, even if the enumerators do.
const Names<ColorizerOptions::Recipe> kRecipes = {{ColorizerOptions::Recipe::kColor3d, "color3d"},
                                                  {ColorizerOptions::Recipe::kPaper, "paper"}};
const Names<ColorizerOptions::Precision> kPrecisions = {
    {ColorizerOptions::Precision::kAuto, "auto"},
    {ColorizerOptions::Precision::kFloat32, "float32"},
    {ColorizerOptions::Precision::kBfloat16, "bfloat16"}};

template <typename T>
const char* NameOf(const Names<T>& names, T value) {
  for (const auto& [known, name] : names) {
    if (known == value) return name;
  }
  return "";
}

template <typename T>
T FromName(const Names<T>& names, const char* what, const std::string& text) {
  for (const auto& [known, name] : names) {
    if (text == name) return known;
  }
  throw InvalidArgument("the colorizer file has an unknown {}: \"{}\"", what, text);
}

}  // namespace

nlohmann::json JsonFromOptions(const ColorizerOptions& options) {
  return {{"recipe", NameOf(kRecipes, options.recipe)},
          {"precision", NameOf(kPrecisions, options.precision)},
          {"iterations", options.iterations},
          {"time_limit_seconds", options.time_limit_seconds},
          {"max_side_px", options.max_side_px},
          {"crop_px", options.crop_px},
          {"learning_rate", options.learning_rate},
          {"consistency_weight", options.consistency_weight},
          {"average_decay", options.average_decay},
          {"min_improvement", options.min_improvement},
          {"adapter_stages", options.adapter_stages},
          {"decoder_width", options.decoder_width},
          {"seed", options.seed}};
}

ColorizerOptions OptionsFromJson(const nlohmann::json& json) {
  ColorizerOptions options;
  options.recipe = FromName(kRecipes, "recipe", json.at("recipe"));
  options.precision = FromName(
      kPrecisions, "precision", json.value("precision", NameOf(kPrecisions, options.precision)));
  options.iterations = json.at("iterations");
  options.time_limit_seconds = json.at("time_limit_seconds");
  options.max_side_px = json.at("max_side_px");
  options.crop_px = json.at("crop_px");
  options.learning_rate = json.value("learning_rate", options.learning_rate);
  options.consistency_weight = json.at("consistency_weight");
  options.average_decay = json.value("average_decay", options.average_decay);
  options.min_improvement = json.value("min_improvement", options.min_improvement);
  options.adapter_stages = json.value("adapter_stages", options.adapter_stages);
  options.decoder_width = json.value("decoder_width", options.decoder_width);
  options.seed = json.at("seed");
  return options;
}

}  // namespace color3d
