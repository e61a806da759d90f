#include "core/image/weighted_resize.h"

#include "core/image/codec.h"

namespace color3d {

Image ResizeWeighted(const Image& values, const Image& weight, int width, int height) {
  if (values.width == width && values.height == height) return values;
  constexpr float kLeast = 1e-6f;
  Image weighted = values;
  for (int c = 0; c < values.channels; ++c) {
    for (size_t i = 0; i < values.PlaneSize(); ++i) weighted.Plane(c)[i] *= weight.data[i];
  }
  weighted = Resize(weighted, width, height);
  const Image total = Resize(weight, width, height);
  const Image plain = Resize(values, width, height);
  for (int c = 0; c < values.channels; ++c) {
    for (size_t i = 0; i < total.data.size(); ++i) {
      float& value = weighted.Plane(c)[i];
      value = total.data[i] > kLeast ? value / total.data[i] : plain.Plane(c)[i];
    }
  }
  return weighted;
}

}  // namespace color3d
