// Options of the stage generate_augmentations.
#pragma once

#include <string>

namespace color3d {

struct AugmentationOptions {
  bool files = false;  // the user's own, below augment/ of the scene's folder
  int samples = 8;     // 0..64, besides the user's own files; 8: the paper's 4 + 1 + 3
  bool outpaint = true;
  bool animate = true;
  bool novel_views = true;
  std::string backend;    // a generator by name; empty: the embedded surrogates
  int max_side_px = 400;  // of the pictures, 64..4096
  void Validate() const;
  bool operator==(const AugmentationOptions&) const = default;
};

}  // namespace color3d
