// Digest of a network: SHA-256 over its architecture and weights.
#pragma once

#include <fmt/core.h>

#include <string>
#include <string_view>

#include "core/base/digest.h"
#include "core/weights/weight_map.h"

namespace color3d {

// `architecture` describes all that the weights do not determine.
inline std::string DigestOfWeights(std::string_view architecture, const WeightMap& weights) {
  Sha256 hash;
  hash.Update(architecture);
  for (const auto& [name, array] : weights) {
    std::string shape = "\n" + name;
    for (int64_t size : array.shape) shape += fmt::format(" {}", size);
    hash.Update(shape + "\n");
    hash.Update(
        {reinterpret_cast<const char*>(array.values.data()), array.values.size() * sizeof(float)});
  }
  return hash.FinishHex();
}

}  // namespace color3d
