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
const Names<ColorizerOptions::Recipe> kRecipes = {
    {ColorizerOptions::Recipe::kColor3d, "color3d"},
    {ColorizerOptions::Recipe::kPaper, "paper"},
    {ColorizerOptions::Recipe::kFeedForward, "feed_forward"}};
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

// Calls `visit` with the name and the value of each number of `options`.
template <typename Options, typename Visit>
void ForEachNumber(Options& options, const Visit& visit) {
  visit("iterations", options.iterations);
  visit("time_limit_seconds", options.time_limit_seconds);
  visit("max_side_px", options.max_side_px);
  visit("crop_px", options.crop_px);
  visit("learning_rate", options.learning_rate);
  visit("consistency_weight", options.consistency_weight);
  visit("average_decay", options.average_decay);
  visit("min_improvement", options.min_improvement);
  visit("adapter_stages", options.adapter_stages);
  visit("decoder_width", options.decoder_width);
  visit("seed", options.seed);
}

// As ForEachNumber, of the options that earlier versions do not have.
template <typename Options, typename Visit>
void ForEachLaterOption(Options& options, const Visit& visit) {
  visit("max_gradient_norm", options.max_gradient_norm);
  visit("equal_draws", options.equal_draws);
  visit("full_resolution", options.full_resolution);
  visit("elastic_alpha_px", options.elastic.alpha_px);
  visit("elastic_sigma_px", options.elastic.sigma_px);
  visit("elastic_affine_px", options.elastic.affine_px);
}

}  // namespace

nlohmann::json JsonFromOptions(const ColorizerOptions& options) {
  nlohmann::json json{{"recipe", NameOf(kRecipes, options.recipe)},
                      {"precision", NameOf(kPrecisions, options.precision)}};
  ForEachNumber(options, [&](const char* name, const auto& value) { json[name] = value; });
  // Only what differs: colorizer files of the defaults are those of earlier versions.
  if (!options.augment) json["augment"] = false;
  if (!options.neighbors) json["use_neighbors"] = false;
  const ColorizerOptions unset;
  nlohmann::json defaults;
  ForEachLaterOption(unset, [&](const char* name, const auto& value) { defaults[name] = value; });
  ForEachLaterOption(options, [&](const char* name, const auto& value) {
    if (defaults[name] != value) json[name] = value;
  });
  if (options.elastic.kind == ElasticOptions::Kind::kNoise) json["elastic"] = "noise";
  const bool is_paper = options.recipe == ColorizerOptions::Recipe::kPaper;
  if (options.instance_norm != is_paper) json["instance_norm"] = options.instance_norm;
  return json;
}

ColorizerOptions OptionsFromJson(const nlohmann::json& json) {
  ColorizerOptions options;
  options.recipe = FromName(kRecipes, "recipe", json.at("recipe"));
  options.precision = FromName(
      kPrecisions, "precision", json.value("precision", NameOf(kPrecisions, options.precision)));
  ForEachNumber(options, [&](const char* name, auto& value) { value = json.value(name, value); });
  options.augment = json.value("augment", options.augment);
  options.neighbors = json.value("use_neighbors", options.neighbors);
  ForEachLaterOption(options,
                     [&](const char* name, auto& value) { value = json.value(name, value); });
  if (json.contains("elastic")) options.elastic.kind = ElasticOptions::Kind::kNoise;
  options.instance_norm =
      json.value("instance_norm", options.recipe == ColorizerOptions::Recipe::kPaper);
  return options;
}

}  // namespace color3d
