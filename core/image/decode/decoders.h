// Decoders that are called directly rather than by OpenCV, which would choose one by itself. For
// codec.cc only. Pure functions, thread-safe.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <string_view>

#include "core/image/probe/probe.h"

namespace color3d {

// 8-bit, in OpenCV's order: B, G, R (and A if info.channels is 4). Empty if the data is damaged.
cv::Mat DecodeWebp(std::string_view bytes, const ImageInfo& info);

// 8- or 16-bit B, G, R, with the file's rotation applied. Throws Error{kInvalidArgument} with
// `file_name` if the data is damaged; builds without libheif refuse such files earlier.
cv::Mat DecodeHeif(std::string_view bytes, const std::string& file_name, const ImageInfo& info);

}  // namespace color3d
