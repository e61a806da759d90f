#include "core/encoder/embedded/embedded_weights.h"

#include <string>
#include <utility>

#include "core/weights/safetensors.h"

extern "C" {
extern const char color3d_embedded_weights_begin[];  // embedded_weights.S
extern const char color3d_embedded_weights_end[];
}

namespace color3d {

std::string_view EmbeddedWeightFile() {
  return {color3d_embedded_weights_begin,
          static_cast<size_t>(color3d_embedded_weights_end - color3d_embedded_weights_begin)};
}

WeightMap EmbeddedWeights(std::string_view prefix) {
  WeightMap all = ParseSafetensors(EmbeddedWeightFile());
  WeightMap part;
  for (auto& [name, array] : all) {
    if (name.starts_with(prefix)) part[name.substr(prefix.size())] = std::move(array);
  }
  return part;
}

}  // namespace color3d
