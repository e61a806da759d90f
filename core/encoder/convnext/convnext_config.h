// Sizes of a ConvNeXt (Liu et al. 2022). Plain value, no torch.
#pragma once

#include <string>
#include <vector>

namespace color3d {

struct ConvNextConfig {
  // Stem: one strided convolution. The published networks use 4x4 stride 4 (taps at strides 4..32);
  // ours uses 8x8 stride 2, because sharp chroma needs predictions at stride 2.
  int stem_kernel = 8;
  int stem_stride = 2;
  std::vector<int> dims{24, 48, 96, 192, 384};  // channels per stage; each stage halves the size
  std::vector<int> depths{0, 2, 3, 4, 2};       // blocks per stage; the finest is the stem alone

  int StageCount() const { return static_cast<int>(dims.size()); }
  // Stride of a stage's tap, in pixels of the input.
  int Stride(int stage) const { return stem_stride << stage; }
  // Returns a line with all facts that the weights do not determine. Part of the digest.
  std::string ToString() const;
};

}  // namespace color3d
