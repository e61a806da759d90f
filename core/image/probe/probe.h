// Header information of an image file without decoding it, and a check of its structure. Plain C++,
// no codec: safe on hostile input, light enough for the server.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace color3d {

enum class ImageFormat { kJpeg, kPng, kTiff, kWebp, kBmp, kHeif };

struct ImageInfo {
  ImageFormat format = ImageFormat::kJpeg;
  int width = 0;  // px, as stored (before EXIF orientation); of HEIC as looked at
  int height = 0;
  int bits_per_channel = 8;
  int channels = 0;
  bool min_is_white = false;  // TIFF: grey values count down from white
  size_t tiff_directory = 0;  // of the selected page: tiff_pages.h
};

struct ImageLimits {
  int64_t max_pixels = 200'000'000;
  int max_side_px = 30'000;
};

// Throws Error{kInvalidArgument}, in one line with `file_name`, if the bytes are not a picture in a
// supported format ("is not an image"), are truncated ("is truncated"), are in CMYK or animated, or
// claim more pixels than `limits` allows (kResourceExhausted). Checks JPEG marker structure up to
// EOI, PNG chunks up to IEND, the strips of the selected TIFF page, WebP's chunks, the size of
// BMP's rows, and the location of the parts of a HEIC picture.
ImageInfo ProbeImage(std::string_view bytes,
                     const std::string& file_name,
                     const ImageLimits& limits = {});

// Returns true for the supported file name extensions in any case: those of ReadableImageEndings().
bool HasImageExtension(std::string_view path);

// For messages and help texts: "JPEG, PNG, TIFF, WebP, BMP or HEIC", and ".jpg, .jpeg, .png, ...".
// Includes HEIC if the build has libheif.
std::string ReadableImageFormats();
std::string ReadableImageEndings();

// Returns true if this build decodes HEIC pictures.
bool ReadsHeif();

}  // namespace color3d
