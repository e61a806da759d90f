// Pictures of a scene's views: decoded, undistorted, reduced to a working size, converted to L, and
// cached within a budget in bytes, so that memory does not grow with the number of photos.
// Thread-safe. Resampled as sRGB (bicubic at up to twice the working size, then area-averaged), so
// that Luminance() is exactly the L of Srgb().
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "core/base/image.h"
#include "core/scene/scene.h"

namespace color3d {

class ViewImages {
 public:
  // `scene` and the files below `scene_folder` must outlive this object. Working size: the longer
  // side of every picture is at most max_side_px (<= 0: full size).
  ViewImages(const Scene& scene,
             std::filesystem::path scene_folder,
             int max_side_px,
             int64_t cache_budget_bytes = int64_t{1} << 30);
  ~ViewImages();

  // Camera of the picture that Luminance() and Srgb() return.
  Camera WorkingCamera(int view) const;
  // 1 channel, L in 0..100, captured precision.
  std::shared_ptr<const Image> Luminance(int view) const;
  // 1 channel: 1 where the photo is used, 0 where it is masked out, even in part; null: no mask.
  std::shared_ptr<const Image> Mask(int view) const;
  // 3 channels, sRGB 0..1 (grey photos: three equal channels). Not cached.
  Image Srgb(int view) const;
  // Undistorts and reduces any picture (1..4 channels) of the size of the captured photo after EXIF
  // orientation, in the same way. Throws Error{kInvalidArgument} with both sizes if its size
  // differs.
  Image Undistort(int view, const Image& captured) const;
  // As Undistort for a picture in a file, with little memory. Channels as from ReadImage.
  Image UndistortFile(int view, const std::filesystem::path& file) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace color3d
