// What an image file claims to be, read from its header without decoding it, and whether the file
// is structurally whole. Plain C++, no codec: safe on hostile input, light enough for the server.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace color3d {

enum class ImageFormat { kJpeg, kPng, kTiff };

struct ImageInfo {
  ImageFormat format = ImageFormat::kJpeg;
  int width = 0;  // px, as stored (before EXIF orientation)
  int height = 0;
  int bits_per_channel = 8;
  int channels = 0;
  bool min_is_white = false;  // TIFF greys that count from white
};

struct ImageLimits {
  int64_t max_pixels = 200'000'000;
  int max_side_px = 30'000;
};

// Throws Error{kInvalidArgument}, in one line that names `file_name`, when the bytes are not a
// JPEG, PNG or TIFF image ("is not an image"), are cut short ("is truncated"), or claim more pixels
// than `limits` allows (kResourceExhausted). Checks JPEG marker structure up to EOI, PNG chunks up
// to IEND, TIFF's first directory and strips.
ImageInfo ProbeImage(std::string_view bytes,
                     const std::string& file_name,
                     const ImageLimits& limits = {});

// True for the file name endings that we read: .jpg .jpeg .png .tif .tiff, any case.
bool HasImageExtension(std::string_view path);

}  // namespace color3d
