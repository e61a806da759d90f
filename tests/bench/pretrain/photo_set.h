// Colour photographs for pre-training, kept in memory as bytes, and random crops of them. Immutable
// after construction, thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/image.h"
#include "core/base/random.h"

namespace color3d {

struct PhotoFolder {
  std::filesystem::path path;  // searched recursively
  double weight = 1.0;         // share of the crops, relative to the other folders
};

struct TrainingCrop {
  Image srgb;       // 3 channels, what the teacher sees
  Image luminance;  // 1 channel, L 0..100, degraded like old photographs: what the student sees
  Image ab;         // 2 channels, Lab units, the truth
};

class PhotoSet {
 public:
  // Grey photographs are left out. Throws Error{kInvalidArgument} for a folder without photographs.
  explicit PhotoSet(const std::vector<PhotoFolder>& folders);

  size_t size() const { return photos_.size(); }
  // A random part of a random photo at random scale, size_px x size_px, maybe mirrored.
  TrainingCrop Crop(int size_px, Random& random) const;

 private:
  struct Photo {
    int width = 0;
    int height = 0;
    std::vector<uint8_t> data;  // planar RGB
  };
  std::vector<Photo> photos_;
  std::vector<double> upper_;  // cumulative share of the photos
};

}  // namespace color3d
