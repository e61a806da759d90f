// Reading photographs at another size than their own, in little memory. Pure functions,
// thread-safe.
#pragma once

#include <filesystem>
#include <functional>

#include "core/base/image.h"
#include "core/image/probe/orientation.h"

namespace color3d {

// ReadImage's picture reduced so that the longer side is at most `max_side_px` (> 0; never
// enlarged). Large JPEG files are decoded at a fraction of their size, many times quicker than
// ReadImage. Throws what ReadImage throws.
Image ReadImageWithin(const std::filesystem::path& path, int max_side_px);

// ReadImage's picture as Resize makes it of the size that `wanted` says when it is told the
// picture's own. What `wanted` throws passes through. Of large pictures only the reduced one is
// ever held as floats. Throws what ReadImage throws.
Image ReadImageResized(const std::filesystem::path& path,
                       const std::function<PictureSize(const PictureSize& own)>& wanted);

// ReadImageResized that never enlarges: the longer side is at most `max_side_px`, as FitWithin has
// it. Slower than ReadImageWithin for JPEG files and exact.
Image ReadImageFitted(const std::filesystem::path& path, int max_side_px);

// The size that FitWithin gives a picture of the size `own`.
PictureSize SizeWithin(const PictureSize& own, int max_side_px);

}  // namespace color3d
