#include "core/scene/masks/still_regions.h"

#include "core/scene/photo_masks.h"

namespace color3d {

Image StillRegion(const ViewImages& images, const Scene& scene, int view, const Image& moving) {
  const Camera& captured = scene.views.at(view).captured_camera;
  Image still(captured.width, captured.height, 1);
  for (int y = 0; y < still.height; ++y) {
    const int from_y = static_cast<int>(int64_t{y} * moving.height / still.height);
    for (int x = 0; x < still.width; ++x) {
      const int from_x = static_cast<int>(int64_t{x} * moving.width / still.width);
      still.At(0, y, x) = moving.At(0, from_y, from_x) > 0.5f ? 0.0f : 1.0f;
    }
  }
  const Image reduced = images.Undistort(view, still);
  return ResizeMask(reduced, reduced.width, reduced.height);
}

}  // namespace color3d
