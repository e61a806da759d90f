#include "core/image/probe/probe.h"

#include <algorithm>
#include <cctype>
#include <iterator>

#include "core/base/text/lower_case.h"
#include "core/image/probe/probe_formats.h"

namespace color3d {
namespace probe_internal {

Error ProbeContext::Truncated(const std::string& what) const {
  return InvalidArgument("{} is truncated: {}; copy the file again", file_name, what);
}

Error ProbeContext::Damaged(const std::string& what) const {
  return InvalidArgument("{} is damaged: {}; copy or save the file again", file_name, what);
}

Error ProbeContext::InCmyk() const {
  return InvalidArgument("{} is in CMYK, which is not supported; convert it to RGB (sRGB)",
                         file_name);
}

void ProbeContext::CheckSize(int64_t width, int64_t height) const {
  if (width <= 0 || height <= 0) {
    throw Damaged("it claims {} x {} px", width, height);
  }
  if (width > limits.max_side_px || height > limits.max_side_px ||
      width > limits.max_pixels / height) {
    throw Error(ErrorCode::kResourceExhausted,
                "{} claims {} x {} px; the limit is {} px a side and {} px in all",
                file_name,
                width,
                height,
                limits.max_side_px,
                limits.max_pixels);
  }
}

}  // namespace probe_internal

namespace {

struct Ending {
  std::string_view text;  // without the dot
  ImageFormat format;
};
constexpr Ending kEndings[] = {{"jpg", ImageFormat::kJpeg},
                               {"jpeg", ImageFormat::kJpeg},
                               {"jpe", ImageFormat::kJpeg},
                               {"jfif", ImageFormat::kJpeg},
                               {"png", ImageFormat::kPng},
                               {"tif", ImageFormat::kTiff},
                               {"tiff", ImageFormat::kTiff},
                               {"webp", ImageFormat::kWebp},
                               {"bmp", ImageFormat::kBmp},
                               {"heic", ImageFormat::kHeif},
                               {"heif", ImageFormat::kHeif},
                               {"hif", ImageFormat::kHeif}};

bool IsReadable(ImageFormat format) { return format != ImageFormat::kHeif || ReadsHeif(); }

// First bytes of files that users mistake for photographs.
struct Beginning {
  std::string_view bytes;
  const char* kind;
};
constexpr Beginning kOtherKinds[] = {{"GIF8", "GIF"},
                                     {"8BPS", "PSD"},
                                     {"%PDF", "PDF"},
                                     {"SDPX", "DPX"},
                                     {"XPDS", "DPX"},
                                     {"\x76\x2F\x31\x01", "OpenEXR"},
                                     {"\xFF\x0A", "JPEG XL"},
                                     {std::string_view("\0\0\0\x0CJXL ", 8), "JPEG XL"},
                                     {std::string_view("\0\0\0\x0CjP  ", 8), "JPEG 2000"},
                                     {"\xFF\x4F\xFF\x51", "JPEG 2000"},
                                     {"FUJIFILMCCD-RAW", "raw"},
                                     {"IIRO", "raw"},
                                     {std::string_view("IIU\0", 4), "raw"}};

}  // namespace

ImageInfo ProbeImage(std::string_view bytes,
                     const std::string& file_name,
                     const ImageLimits& limits) {
  const probe_internal::ProbeContext context{bytes, file_name, limits};
  if (probe_internal::IsJpeg(bytes)) return probe_internal::ProbeJpeg(context);
  if (probe_internal::IsPng(bytes)) return probe_internal::ProbePng(context);
  if (probe_internal::IsTiff(bytes)) return probe_internal::ProbeTiff(context);
  if (probe_internal::IsWebp(bytes)) return probe_internal::ProbeWebp(context);
  if (probe_internal::IsBmp(bytes)) return probe_internal::ProbeBmp(context);
  if (probe_internal::IsHeif(bytes)) return probe_internal::ProbeHeif(context);
  for (const Beginning& other : kOtherKinds) {
    if (!bytes.starts_with(other.bytes)) continue;
    throw InvalidArgument(
        "{} is a {} file, not an image that can be read ({}); convert it to PNG or TIFF",
        file_name,
        other.kind,
        ReadableImageFormats());
  }
  throw InvalidArgument("{}{} not an image ({})",
                        file_name,
                        bytes.empty() ? " is empty," : " is",
                        ReadableImageFormats());
}

bool HasImageExtension(std::string_view path) {
  const size_t dot = path.rfind('.');
  if (dot == std::string_view::npos || path.size() - dot > 5) return false;
  const std::string ending = LowerCase(path.substr(dot + 1));
  return std::any_of(std::begin(kEndings), std::end(kEndings), [&](const Ending& known) {
    return known.text == ending && IsReadable(known.format);
  });
}

std::string ReadableImageFormats() {
  return ReadsHeif() ? "JPEG, PNG, TIFF, WebP, BMP or HEIC" : "JPEG, PNG, TIFF, WebP or BMP";
}

std::string ReadableImageEndings() {
  std::string text;
  for (const Ending& ending : kEndings) {
    if (!IsReadable(ending.format)) continue;
    text += (text.empty() ? "." : ", .") + std::string(ending.text);
  }
  return text;
}

bool ReadsHeif() {
#ifdef COLOR3D_HEIF
  return true;
#else
  return false;
#endif
}

}  // namespace color3d
