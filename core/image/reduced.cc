#include "core/image/reduced.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/decode.h"

namespace color3d {

PictureSize SizeWithin(const PictureSize& own, int max_side_px) {
  const int side = std::max(own.width, own.height);
  if (max_side_px <= 0 || side <= max_side_px) return own;
  const double scale = static_cast<double>(max_side_px) / side;
  return {std::max(1, static_cast<int>(std::lround(own.width * scale))),
          std::max(1, static_cast<int>(std::lround(own.height * scale)))};
}

Image ReadImageResized(const std::filesystem::path& path,
                       const std::function<PictureSize(const PictureSize& own)>& wanted) {
  const std::string bytes = ReadFile(path);
  const std::string name = path.filename().string();
  return Decode(bytes, name, ProbeImage(bytes, name), {.wanted = wanted});
}

Image ReadImageFitted(const std::filesystem::path& path, int max_side_px) {
  return ReadImageResized(path,
                          [&](const PictureSize& own) { return SizeWithin(own, max_side_px); });
}

Image DecodeImageWithin(std::string_view bytes, const std::string& file_name, int max_side_px) {
  if (max_side_px < 1) {
    throw InvalidArgument("a picture cannot be reduced to {} px", max_side_px);
  }
  const ImageInfo info = ProbeImage(bytes, file_name);
  DecodeRequest request;
  request.wanted = [&](const PictureSize& own) { return SizeWithin(own, max_side_px); };
  if (info.format == ImageFormat::kJpeg) {
    // Keeps twice the wanted size, so that the last step still averages areas.
    const int side = std::max(info.width, info.height);
    int& reduction = request.jpeg_reduction;
    while (reduction < 8 && side / (2 * reduction) >= 2 * max_side_px) reduction *= 2;
  }
  return Decode(bytes, file_name, info, request);
}

Image ReadImageWithin(const std::filesystem::path& path, int max_side_px) {
  return DecodeImageWithin(ReadFile(path), path.filename().string(), max_side_px);
}

}  // namespace color3d
