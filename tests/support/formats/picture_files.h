// Pictures in formats that the product only reads, with several pages or colour profiles. Pure
// functions.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/image.h"

namespace color3d {

// One page of a TIFF of grey or RGB, 8 or 16 bits, uncompressed.
struct TiffPageToWrite {
  Image image;  // 1 or 3 channels, 0..1
  int bits = 8;
  uint32_t subfile_type = 0;  // 1: a reduced copy; 4: a mask
  uint32_t photometric = 1;   // 2 for RGB
  uint32_t orientation = 1;
  std::string profile;                           // ICC
  std::vector<TiffPageToWrite> sub_directories;  // pages that hang below this one
};
std::string TiffFile(const std::vector<TiffPageToWrite>& pages, bool big_endian = false);

// 24-bit, rows from bottom to top as usual; with `profile` a BITMAPV5HEADER.
std::string BmpFile(const Image& srgb, const std::string& profile = "");
std::string WebpFile(const Image& srgb, const std::string& profile = "");
// Empty if libheif or its encoder is missing.
std::string HeicFile(const Image& srgb, const std::string& profile = "", int bits = 8);

// Inserts a chunk after a PNG's header; a segment after a JPEG's first segment.
std::string WithPngChunk(const std::string& png, const std::string& type, const std::string& body);
std::string WithJpegSegment(const std::string& jpeg, int marker, const std::string& body);
std::string WithPngProfile(const std::string& png, const std::string& profile);
// In parts of at most `part_bytes`.
std::string WithJpegProfile(const std::string& jpeg,
                            const std::string& profile,
                            size_t part_bytes = 65000);

// ICC profiles of known spaces.
std::string AdobeRgbProfile();
std::string ProPhotoProfile();
std::string DisplayP3Profile();
std::string GrayGammaProfile(double gamma);
std::string DotGainProfile(double percent);  // gain of dots of 50 %
std::string CmykProfile();
// Converts the image, 1 or 3 channels, to the space of `profile`.
Image ConvertToProfile(const Image& srgb, const std::string& profile);

}  // namespace color3d
