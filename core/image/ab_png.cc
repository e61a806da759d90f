#include <algorithm>
#include <string>

#include "core/base/error.h"
#include "core/image/codec.h"

namespace color3d {

std::string EncodeAbPng(const Image& ab, const Image& confidence) {
  const bool has_confidence = !confidence.Empty();
  if (ab.channels != 2 || ab.Empty() ||
      (has_confidence && (confidence.channels != 1 || confidence.width != ab.width ||
                          confidence.height != ab.height))) {
    throw InvalidArgument(
        "an ab map needs 2 channels and a confidence of its size, got {} x {} x {} and {} x {}",
        ab.width,
        ab.height,
        ab.channels,
        confidence.width,
        confidence.height);
  }
  Image packed(ab.width, ab.height, 3, 1.0f);
  const size_t n = ab.PlaneSize();
  for (size_t i = 0; i < 2 * n; ++i) packed.data[i] = (ab.data[i] + 128.0f) / 255.0f;
  if (has_confidence) std::copy_n(confidence.data.begin(), n, packed.Plane(2));
  return EncodePng16(packed);
}

AbMap DecodeAbPng(std::string_view bytes, const std::string& file_name) {
  const ImageInfo info = ProbeImage(bytes, file_name);
  if (info.format != ImageFormat::kPng || info.bits_per_channel != 16 ||
      (info.channels != 3 && info.channels != 4)) {
    throw InvalidArgument("{} is not an ab map: a 16-bit RGB PNG is needed", file_name);
  }
  const Image packed = DecodeImage(bytes, file_name);
  AbMap map{Image(packed.width, packed.height, 2), Image(packed.width, packed.height, 1)};
  const size_t n = packed.PlaneSize();
  for (size_t i = 0; i < 2 * n; ++i) map.ab.data[i] = 255.0f * packed.data[i] - 128.0f;
  std::copy_n(packed.Plane(2), n, map.confidence.data.begin());
  return map;
}

}  // namespace color3d
