#include <algorithm>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "core/base/error.h"
#include "core/image/codec.h"
#include "core/image/reduced.h"

namespace color3d {
namespace {

// A mean lies between the least and the largest value, but its weights are rounded: those of a
// white plane sum up to a hair above 1.
void KeepRange(const float* from, size_t from_count, float* to, size_t to_count) {
  float least = from[0], largest = from[0];
  for (size_t i = 1; i < from_count; ++i) {
    least = std::min(least, from[i]);
    largest = std::max(largest, from[i]);
  }
  for (size_t i = 0; i < to_count; ++i) to[i] = std::clamp(to[i], least, largest);
}

Image ResizeWith(const Image& image, int width, int height, int interpolation) {
  Image out(width, height, image.channels);
  try {
    for (int c = 0; c < image.channels; ++c) {
      const cv::Mat from(image.height, image.width, CV_32F, const_cast<float*>(image.Plane(c)));
      cv::Mat to(height, width, CV_32F, out.Plane(c));
      cv::resize(from, to, to.size(), 0, 0, interpolation);
      KeepRange(image.Plane(c), image.PlaneSize(), out.Plane(c), out.PlaneSize());
    }
  } catch (const cv::Exception& e) {
    if (e.code == cv::Error::StsNoMem) throw std::bad_alloc();
    throw Error(ErrorCode::kInternal, "resizing failed: {}", e.err);
  }
  return out;
}

}  // namespace

Image Resize(const Image& image, int width, int height) {
  if (image.Empty() || width < 1 || height < 1) {
    throw InvalidArgument(
        "cannot resize {} x {} px to {} x {} px", image.width, image.height, width, height);
  }
  if (width == image.width && height == image.height) return image;
  // Shrinks first, each side on its own, then enlarges: area averaging only shrinks.
  const int down_width = std::min(width, image.width);
  const int down_height = std::min(height, image.height);
  Image out = down_width == image.width && down_height == image.height
                  ? image
                  : ResizeWith(image, down_width, down_height, cv::INTER_AREA);
  if (width == out.width && height == out.height) return out;
  return ResizeWith(out, width, height, cv::INTER_LINEAR);
}

Image FitWithin(const Image& image, int max_side_px) {
  const PictureSize size = SizeWithin({image.width, image.height}, max_side_px);
  if (size.width == image.width && size.height == image.height) return image;
  return Resize(image, size.width, size.height);
}

}  // namespace color3d
