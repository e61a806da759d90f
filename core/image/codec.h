// Decoding, encoding and resampling of pictures (OpenCV inside, never in this interface).
// Pure functions, thread-safe.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/image.h"
#include "core/image/probe/probe.h"

namespace color3d {

// Decodes a picture: sRGB in 0..1, 1 channel (grey) or 3 (RGB), EXIF orientation applied, 8- or
// 16-bit precision kept. Colours in another colour space are converted (srgb_conversion.h). Reads
// the largest page of a TIFF. With `keep_alpha`, alpha is a last channel (2 or 4 channels). Throws
// Error{kInvalidArgument} with `file_name` (see ProbeImage) or if decoding fails.
Image DecodeImage(std::string_view bytes, const std::string& file_name, bool keep_alpha = false);
Image ReadImage(const std::filesystem::path& path, bool keep_alpha = false);
// ReadImage for pictures whose values are labels, not colours: without conversion.
Image ReadStoredValues(const std::filesystem::path& path);

// A note for the user on how a picture is read, to follow its name: the selected page, an unusable
// colour profile. Never throws; safe on hostile input.
std::vector<std::string> PictureNotes(std::string_view bytes);

// Returns true if a 3-channel sRGB image is grey: every |R-G|, |G-B| <= `tolerance` (0..1) for at
// least 99.5 % of the pixels. 1-channel images are grey.
bool IsGray(const Image& srgb, float tolerance = 0.02f);

// Encodes a file tagged as sRGB; values are clamped to 0..1. 1 or 3 channels (4 with alpha for
// PNG).
std::string EncodePng8(const Image& image);
std::string EncodePng16(const Image& image);
std::string EncodeJpeg(const Image& image, int quality = 92);

// Area averaging to smaller sizes, bilinear to larger ones; any channel count.
Image Resize(const Image& image, int width, int height);
// Resizes so that the longer side is at most `max_side_px` (never enlarges). <= 0: a copy.
Image FitWithin(const Image& image, int max_side_px);

// ab maps (2 channels, Lab units) as 16-bit PNG: R = (a+128)/255, G = (b+128)/255, B = confidence
// in 0..1 (1 when `confidence` is empty). Lossless to 0.004 Lab units.
std::string EncodeAbPng(const Image& ab, const Image& confidence = {});
struct AbMap {
  Image ab;          // 2 channels, Lab units
  Image confidence;  // 1 channel, 0..1
};
AbMap DecodeAbPng(std::string_view bytes, const std::string& file_name);

}  // namespace color3d
