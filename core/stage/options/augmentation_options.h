// Options of the stage generate_augmentations.
#pragma once

#include <string>

namespace color3d {

struct AugmentationOptions {
  bool files = false;  // use files below augment/ of the scene's folder
  int samples = 8;     // pictures besides files, 0..64; 8: the paper's 4 + 1 + 3
  bool outpaint = true;
  bool animate = true;
  bool novel_views = true;
  std::string backend;    // name of a generator; empty: embedded surrogates
  int max_side_px = 400;  // longer side of the pictures, 64..4096
  void Validate() const;
  bool operator==(const AugmentationOptions&) const = default;
};

}  // namespace color3d
