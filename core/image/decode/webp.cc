#include <webp/decode.h>

#include <cstdint>

#include "core/image/decode/decoders.h"

namespace color3d {

cv::Mat DecodeWebp(std::string_view bytes, const ImageInfo& info) {
  const auto* data = reinterpret_cast<const uint8_t*>(bytes.data());
  int width = 0, height = 0;
  if (WebPGetInfo(data, bytes.size(), &width, &height) == 0 || width != info.width ||
      height != info.height) {
    return {};
  }
  cv::Mat mat(height, width, info.channels == 4 ? CV_8UC4 : CV_8UC3);
  const size_t size = mat.total() * mat.elemSize();
  const auto stride = static_cast<int>(mat.step);
  const auto* decoded = info.channels == 4
                            ? WebPDecodeBGRAInto(data, bytes.size(), mat.data, size, stride)
                            : WebPDecodeBGRInto(data, bytes.size(), mat.data, size, stride);
  return decoded == nullptr ? cv::Mat() : mat;
}

}  // namespace color3d
