// Decoders of formats that OpenCV is not asked for, since it would choose one by itself. For
// codec.cc only. Pure functions, thread-safe.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <string_view>

#include "core/image/probe/probe.h"

namespace color3d {

// 8-bit, as OpenCV keeps it: B, G, R (and A when info.channels is 4). Empty when the data is
// damaged.
cv::Mat DecodeWebp(std::string_view bytes, const ImageInfo& info);

// 8- or 16-bit B, G, R, turned as the file says. Throws Error{kInvalidArgument} naming `file_name`
// when its data is damaged; such a file is refused before where the build has no libheif.
cv::Mat DecodeHeif(std::string_view bytes, const std::string& file_name, const ImageInfo& info);

}  // namespace color3d
