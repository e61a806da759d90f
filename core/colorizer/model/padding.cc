#include "core/colorizer/model/padding.h"

#include <torch/types.h>

namespace color3d {

torch::Tensor PadToMultiple(const torch::Tensor& x, int multiple) {
  const int64_t right = (multiple - x.size(3) % multiple) % multiple;
  const int64_t bottom = (multiple - x.size(2) % multiple) % multiple;
  if (right == 0 && bottom == 0) return x;
  const bool can_reflect = right < x.size(3) && bottom < x.size(2);
  return can_reflect ? torch::reflection_pad2d(x, {0, right, 0, bottom})
                     : torch::replication_pad2d(x, {0, right, 0, bottom});
}

Image CropTo(const Image& image, int width, int height) {
  Image out(width, height, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) out.At(c, y, x) = image.At(c, y, x);
    }
  }
  return out;
}

}  // namespace color3d
