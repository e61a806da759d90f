// Readers of the formats of ProbeImage. For this folder only.
#pragma once

#include <fmt/core.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/image/probe/byte_reader.h"
#include "core/image/probe/probe.h"

namespace color3d::probe_internal {

struct ProbeContext {
  std::string_view bytes;
  const std::string& file_name;
  const ImageLimits& limits;

  // "a.jpg is truncated: ..." and "a.jpg is damaged: ...".
  Error Truncated(const std::string& what) const;
  Error Damaged(const std::string& what) const;
  // Formats `what` with fmt.
  template <typename First, typename... Rest>
  Error Truncated(fmt::format_string<First, Rest...> what, First&& first, Rest&&... rest) const {
    return Truncated(fmt::format(what, std::forward<First>(first), std::forward<Rest>(rest)...));
  }
  template <typename First, typename... Rest>
  Error Damaged(fmt::format_string<First, Rest...> what, First&& first, Rest&&... rest) const {
    return Damaged(fmt::format(what, std::forward<First>(first), std::forward<Rest>(rest)...));
  }
  // Error for CMYK pictures, whose colours depend on press and paper.
  Error InCmyk() const;
  // Throws for sizes of zero or above the limits.
  void CheckSize(int64_t width, int64_t height) const;
};

ImageInfo ProbeJpeg(const ProbeContext& context);
ImageInfo ProbePng(const ProbeContext& context);
ImageInfo ProbeTiff(const ProbeContext& context);
ImageInfo ProbeWebp(const ProbeContext& context);
ImageInfo ProbeBmp(const ProbeContext& context);
ImageInfo ProbeHeif(const ProbeContext& context);

bool IsJpeg(std::string_view bytes);
bool IsPng(std::string_view bytes);
bool IsTiff(std::string_view bytes);
bool IsWebp(std::string_view bytes);
bool IsBmp(std::string_view bytes);
// HEIF family (ISO 23008-12): HEIC, and AVIF, which ProbeHeif refuses.
bool IsHeif(std::string_view bytes);

// Body of a WebP's first chunk of this type; empty if there is none.
std::string_view FindWebpChunk(std::string_view bytes, std::string_view type);
// EXIF block and ICC profile of a HEIC picture; empty if there is none.
std::string_view FindHeifExif(std::string_view bytes);
std::string_view FindHeifProfile(std::string_view bytes);

// A TIFF file or an EXIF block, which has the same form.
struct TiffHeader {
  bool big_endian = false;
  size_t first_directory = 0;
};
// Returns false if the bytes do not start as TIFF.
bool ReadTiffHeader(std::string_view bytes, TiffHeader* header);

}  // namespace color3d::probe_internal
