// Memory-saving decoding of photographs at a reduced size. Pure functions, thread-safe.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "core/base/image.h"
#include "core/image/probe/orientation.h"

namespace color3d {

// ReadImage's picture reduced so that the longer side is at most `max_side_px` (> 0; never
// enlarged). Large JPEG files are decoded at a fraction of their size, many times quicker than
// ReadImage. Throws what ReadImage throws.
Image ReadImageWithin(const std::filesystem::path& path, int max_side_px);
Image DecodeImageWithin(std::string_view bytes, const std::string& file_name, int max_side_px);

// Decodes like ReadImage and resizes like Resize to the size that `wanted` returns for the
// picture's own size. Exceptions of `wanted` pass through. Only the reduced copy of a large picture
// is held as floats. Throws as ReadImage.
Image ReadImageResized(const std::filesystem::path& path,
                       const std::function<PictureSize(const PictureSize& own)>& wanted);

// ReadImageResized without enlargement: the longer side is at most `max_side_px`, as in FitWithin.
// Slower than ReadImageWithin for JPEG files, but exact.
Image ReadImageFitted(const std::filesystem::path& path, int max_side_px);

// The size that FitWithin returns for a picture of the size `own`.
PictureSize SizeWithin(const PictureSize& own, int max_side_px);

}  // namespace color3d
