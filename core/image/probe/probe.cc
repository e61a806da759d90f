#include "core/image/probe/probe.h"

#include <algorithm>
#include <cctype>

#include "core/image/probe/probe_formats.h"

namespace color3d {
namespace probe_internal {

Error ProbeContext::Truncated(const std::string& what) const {
  return InvalidArgument("{} is truncated: {}; copy the file again", file_name, what);
}

Error ProbeContext::Damaged(const std::string& what) const {
  return InvalidArgument("{} is damaged: {}; copy or save the file again", file_name, what);
}

void ProbeContext::CheckSize(int64_t width, int64_t height) const {
  if (width <= 0 || height <= 0) {
    throw Damaged("it claims {} x {} px", width, height);
  }
  if (width > limits.max_side_px || height > limits.max_side_px ||
      width > limits.max_pixels / height) {
    throw Error(ErrorCode::kResourceExhausted,
                "{} claims {} x {} px; the limit is {} px a side and {} px in all",
                file_name,
                width,
                height,
                limits.max_side_px,
                limits.max_pixels);
  }
}

}  // namespace probe_internal

ImageInfo ProbeImage(std::string_view bytes,
                     const std::string& file_name,
                     const ImageLimits& limits) {
  const probe_internal::ProbeContext context{bytes, file_name, limits};
  if (probe_internal::IsJpeg(bytes)) return probe_internal::ProbeJpeg(context);
  if (probe_internal::IsPng(bytes)) return probe_internal::ProbePng(context);
  if (probe_internal::IsTiff(bytes)) return probe_internal::ProbeTiff(context);
  throw InvalidArgument(
      "{}{} not an image (JPEG, PNG or TIFF)", file_name, bytes.empty() ? " is empty," : " is");
}

bool HasImageExtension(std::string_view path) {
  const size_t dot = path.rfind('.');
  if (dot == std::string_view::npos || path.size() - dot > 5) return false;
  std::string ending(path.substr(dot + 1));
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  return ending == "jpg" || ending == "jpeg" || ending == "png" || ending == "tif" ||
         ending == "tiff";
}

}  // namespace color3d
