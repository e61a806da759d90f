// What an image file claims to be, read from its header without decoding it, and whether the file
// is structurally whole. Plain C++, no codec: safe on hostile input, light enough for the server.
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
  bool min_is_white = false;  // TIFF greys that count from white
  size_t tiff_directory = 0;  // of the page that is read: tiff_pages.h
};

struct ImageLimits {
  int64_t max_pixels = 200'000'000;
  int max_side_px = 30'000;
};

// Throws Error{kInvalidArgument}, in one line that names `file_name`, when the bytes are not a
// picture in a format that we read ("is not an image"), are cut short ("is truncated"), are in CMYK
// or animated, or claim more pixels than `limits` allows (kResourceExhausted). Checks JPEG marker
// structure up to EOI, PNG chunks up to IEND, the strips of the TIFF page that is read, WebP's
// chunks, the size of BMP's rows, and where the parts of a HEIC picture lie.
ImageInfo ProbeImage(std::string_view bytes,
                     const std::string& file_name,
                     const ImageLimits& limits = {});

// True for the file name endings that we read, any case: those of ReadableImageEndings().
bool HasImageExtension(std::string_view path);

// For messages and help texts. "JPEG, PNG, TIFF, WebP, BMP or HEIC", and ".jpg, .jpeg, .png, ...".
// HEIC is among them where the build has libheif.
std::string ReadableImageFormats();
std::string ReadableImageEndings();

// Whether this build decodes HEIC pictures.
bool ReadsHeif();

}  // namespace color3d
