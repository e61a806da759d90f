// Options of decoding pictures, for this folder only. Thread-safe.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "core/base/image.h"
#include "core/image/probe/orientation.h"
#include "core/image/probe/probe.h"

namespace color3d {

struct DecodeRequest {
  bool keep_alpha = false;
  bool keep_stored_values = false;  // no conversion to sRGB
  // 1, or 2, 4, 8 for JPEG files: divides the sides (rounded up).
  int jpeg_reduction = 1;
  // Receives the picture's size after orientation and returns the wanted size (Resize's result);
  // empty: the original size. Large pictures are reduced before their conversion to floats.
  std::function<PictureSize(const PictureSize&)> wanted;
};

// Throws as DecodeImage.
Image Decode(std::string_view bytes,
             const std::string& file_name,
             const ImageInfo& info,
             const DecodeRequest& request);

}  // namespace color3d
