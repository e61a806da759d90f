// Reading a photograph at the size of a thumbnail. Pure function, thread-safe.
#pragma once

#include <filesystem>

#include "core/base/image.h"

namespace color3d {

// ReadImage's picture reduced so that the longer side is at most `max_side_px` (> 0; never
// enlarged). Large JPEG files are decoded at a fraction of their size, many times quicker than
// ReadImage. Throws what ReadImage throws.
Image ReadImageWithin(const std::filesystem::path& path, int max_side_px);

}  // namespace color3d
