#include "core/encoder/convnext/convnext_weights.h"

#include <fmt/core.h>

#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/weights/weight_reader.h"

namespace color3d {
namespace {

constexpr const char* kPrefixes[] = {"encoder.arch.", "encoder."};  // DDColor, our own
constexpr int64_t kMaxChannels = 16384;
constexpr const char* kStem = "downsample_layers.0.0.weight";

std::string NamePrefix(const WeightMap& weights) {
  for (const char* prefix : kPrefixes) {
    if (weights.count(std::string(prefix) + kStem) > 0) return prefix;
  }
  return "";
}

bool IsUnused(const std::string& name) {
  return name.starts_with("head.") || name.starts_with("head_cls.") || name.starts_with("norm.");
}

std::vector<int64_t> StoredShape(const WeightMap& weights, const std::string& name) {
  const auto found = weights.find(name);
  return found == weights.end() ? std::vector<int64_t>{} : found->second.shape;
}

// The shape of the stem gives its kernel but not its stride: 4x4 is the published one, 8x8 our own.
void ReadStem(const WeightMap& weights, ConvNextConfig& config) {
  const std::vector<int64_t> shape = StoredShape(weights, kStem);
  const bool square = shape.size() == 4 && shape[1] == 3 && shape[2] == shape[3];
  if (!square || (shape[2] != 4 && shape[2] != 8)) {
    throw InvalidArgument(
        "the ConvNeXt's stem is {}; known are [*,3,4,4] (stride 4) and [*,3,8,8] (stride 2)",
        ShapeText(shape));
  }
  config.stem_kernel = static_cast<int>(shape[2]);
  config.stem_stride = config.stem_kernel == 4 ? 4 : 2;
}

ConvNextConfig ReadConfig(const WeightMap& weights) {
  ConvNextConfig config;
  ReadStem(weights, config);
  config.dims.clear();
  config.depths.clear();
  for (int stage = 0;; ++stage) {
    const std::vector<int64_t> shape = StoredShape(
        weights, fmt::format("downsample_layers.{}.{}.weight", stage, stage == 0 ? 0 : 1));
    if (shape.size() != 4) break;
    if (shape[0] < 1 || shape[0] > kMaxChannels) {
      throw InvalidArgument("the ConvNeXt's stage {} has {} channels; at most {} are supported",
                            stage,
                            shape[0],
                            kMaxChannels);
    }
    config.dims.push_back(static_cast<int>(shape[0]));
    int depth = 0;
    while (weights.count(fmt::format("stages.{}.{}.dwconv.weight", stage, depth)) > 0) {
      ++depth;
    }
    config.depths.push_back(depth);
  }
  return config;
}

}  // namespace

bool HoldsConvNext(const WeightMap& weights) {
  return weights.count(NamePrefix(weights) + kStem) > 0;
}

ConvNextWeights TakeConvNextWeights(WeightMap& weights) {
  if (!HoldsConvNext(weights)) {
    throw InvalidArgument("the weights have no ConvNeXt (no \"{}\")", kStem);
  }
  const std::string prefix = NamePrefix(weights);
  ConvNextWeights found;
  for (auto at = weights.lower_bound(prefix); at != weights.end();) {
    const auto current = at++;
    if (!current->first.starts_with(prefix)) break;
    const std::string name = current->first.substr(prefix.size());
    auto node = weights.extract(current);
    if (IsUnused(name)) continue;
    node.key() = name;
    found.weights.insert(std::move(node));
  }
  found.config = ReadConfig(found.weights);
  found.description = "published ConvNeXt, " + found.config.ToString();
  int own_norms = 0;
  for (int stage = 0; stage < found.config.StageCount(); ++stage) {
    own_norms += found.weights.count(fmt::format("norm{}.weight", stage)) > 0 ? 1 : 0;
  }
  if (own_norms == 0) {
    for (int stage = 0; stage < found.config.StageCount(); ++stage) {
      const int64_t c = found.config.dims[stage];
      const std::string name = fmt::format("norm{}", stage);
      const size_t count = static_cast<size_t>(c);
      found.weights[name + ".weight"] = {{c}, std::vector<float>(count, 1.0f)};
      found.weights[name + ".bias"] = {{c}, std::vector<float>(count, 0.0f)};
    }
    found.description += ", taps normalised without scale and shift (the file has none for them)";
  }
  return found;
}

}  // namespace color3d
