#include "core/colorizer/exemplar/exemplar_weights.h"

#include <cstddef>

// NOLINTBEGIN(readability-identifier-naming)
extern "C" {
extern const char color3d_exemplar_weights_begin[];  // exemplar_weights.S
extern const char color3d_exemplar_weights_end[];
}
// NOLINTEND(readability-identifier-naming)

namespace color3d {

std::string_view ExemplarWeightFile() {
  return {color3d_exemplar_weights_begin,
          static_cast<size_t>(color3d_exemplar_weights_end - color3d_exemplar_weights_begin)};
}

}  // namespace color3d
