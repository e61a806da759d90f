// Inception v3 (Szegedy et al. 2016) up to its pooled features, from weights that the user
// provides: the features of FID (Heusel et al. 2017). Immutable, thread-safe. No torch in this
// interface.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/weights/weight_map.h"

namespace color3d {

class InceptionNetwork;

class Inception {
 public:
  // Reads weights with the names of torchvision's inception_v3, which pytorch-fid shares. A final
  // layer of 1008 classes marks the network of the original FID, whose pooling differs in two
  // places. Throws Error{kInvalidArgument} listing weights that are missing, unexpected or
  // misshapen.
  static std::shared_ptr<const Inception> FromWeightFile(const std::filesystem::path& path);
  // All channel counts are the published ones divided by one integer, which the first layer
  // determines: 1 for published weights, more for tests.
  explicit Inception(WeightMap weights);
  ~Inception();

  int feature_count() const;  // 2048 for published weights
  const std::string& description() const { return description_; }
  // Pooled features of a picture (1 or 3 channels, sRGB), stretched to 299 x 299 px bilinearly
  // without antialiasing, as pytorch-fid does.
  std::vector<float> Features(const Image& srgb) const;

 private:
  std::unique_ptr<const InceptionNetwork> network_;
  std::string description_;
};

}  // namespace color3d
