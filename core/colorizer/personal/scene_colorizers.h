// Colours pictures of several scenes, each by the colorizer of its scene. Pictures whose colorizers
// share an encoder and need the same padded size go through the encoder in one pass. No torch in
// this interface. Thread-safe.
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

// Returns the colorizer of a scene, or null if there is none. Must return the same colorizer for a
// scene throughout a call.
using ColorizerLookup = std::function<std::shared_ptr<const Colorizer>(const std::string& scene)>;

// Returns ab (2 channels, Lab units) for each picture, in order and of its size, within 1e-4 of
// Colorizer::Colorize. Throws Error{kNotFound} naming a scene without colorizer, before any
// computation, and kInvalidArgument for pictures that Colorize refuses.
std::vector<Image> ColorizeRouted(std::span<const RoutedPicture> pictures,
                                  const ColorizerLookup& lookup);

}  // namespace color3d
