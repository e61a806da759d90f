// LPIPS (Zhang et al. 2018, version 0.1): perceptual distance of two pictures, from weights that
// the user provides. Immutable, thread-safe. No torch in this interface.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/base/image.h"
#include "core/weights/weight_map.h"

namespace color3d {

class LpipsNetwork;

class Lpips {
 public:
  // `backbone`: torchvision's alexnet or vgg16, told apart by the kernel of the first layer.
  // `linear`: the learnt weights of its five layers, published as alex.pth and vgg.pth
  // (lin0.model.1.weight ...). Throws Error{kInvalidArgument} listing weights that are missing,
  // unexpected or misshapen.
  static std::shared_ptr<const Lpips> FromWeightFiles(const std::filesystem::path& backbone,
                                                      const std::filesystem::path& linear);
  // All channel counts are the published ones divided by one integer, which the first layer
  // determines: 1 for published weights, more for tests.
  Lpips(WeightMap backbone, WeightMap linear);
  ~Lpips();

  const std::string& description() const { return description_; }
  // Distance of two pictures of one size (1 or 3 channels, sRGB): 0 for equal ones; symmetric.
  // Throws Error{kInvalidArgument} for pictures of different size or below 64 px.
  double Distance(const Image& srgb, const Image& other_srgb) const;

 private:
  std::unique_ptr<const LpipsNetwork> network_;
  std::string description_;
};

}  // namespace color3d
