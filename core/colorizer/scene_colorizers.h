// Colouring pictures of many scenes at once: each picture names its scene, and is coloured by that
// scene's colorizer only. Pictures whose colorizers share an encoder and need the same padded size
// go through it in one pass. No torch in this interface. Thread-safe.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/colorizer/colorizer.h"

namespace color3d {

struct RoutedPicture {
  std::string scene;
  const Image* luminance = nullptr;  // 1 channel, L 0..100
};

// The colorizer of a scene; null when there is none. Must give the same one for the same scene
// during a call.
using ColorizerLookup = std::function<std::shared_ptr<const Colorizer>(const std::string& scene)>;

// Two channels (ab, Lab units) for each picture, in their order and of their size; each within 1e-4
// of what its colorizer's Colorize gives. Throws Error{kNotFound} naming a scene without colorizer,
// before anything is computed, and kInvalidArgument for pictures that Colorize refuses.
std::vector<Image> ColorizeRouted(std::span<const RoutedPicture> pictures,
                                  const ColorizerLookup& lookup);

}  // namespace color3d
