#include "core/base/error.h"
#include "core/image/decode/decoders.h"

#ifdef COLOR3D_HEIF
#include <libheif/heif.h>

#include <algorithm>
#include <cstdint>
#include <memory>

namespace color3d {
namespace {

constexpr int kMaxTileSidePx = 4096;

struct Release {
  void operator()(heif_context* context) const { heif_context_free(context); }
  void operator()(heif_image_handle* handle) const { heif_image_handle_release(handle); }
  void operator()(heif_image* image) const { heif_image_release(image); }
};

void Check(const heif_error& error, const std::string& file_name) {
  if (error.code == heif_error_Ok) return;
  std::string reason = error.message == nullptr ? "" : error.message;
  reason.resize(std::min(reason.size(), reason.find('\n')));
  throw InvalidArgument("{} cannot be decoded ({}); convert it to JPEG or PNG", file_name, reason);
}

// Rows of R, G, B with `bits` a sample become rows of B, G, R with all bits of Sample.
template <typename Sample>
void CopyRows(const uint8_t* from, size_t stride, int bits, cv::Mat* mat) {
  const uint32_t top = (1u << bits) - 1;
  constexpr uint32_t kFull = static_cast<Sample>(~Sample{0});
  for (int y = 0; y < mat->rows; ++y) {
    const auto* in = reinterpret_cast<const Sample*>(from + y * stride);
    Sample* out = mat->ptr<Sample>(y);
    for (int i = 0; i < 3 * mat->cols; ++i) {
      const uint32_t value = std::min<uint32_t>(in[i - i % 3 + 2 - i % 3], top);
      out[i] = static_cast<Sample>((value * kFull + top / 2) / top);
    }
  }
}

}  // namespace

cv::Mat DecodeHeif(std::string_view bytes, const std::string& file_name, const ImageInfo& info) {
  const std::unique_ptr<heif_context, Release> context(heif_context_alloc());
  // Tiles may be larger than a small picture.
  heif_context_set_maximum_image_size_limit(context.get(),
                                            std::max({info.width, info.height, kMaxTileSidePx}));
  Check(heif_context_read_from_memory_without_copy(
            context.get(), bytes.data(), bytes.size(), nullptr),
        file_name);
  heif_image_handle* raw_handle = nullptr;
  Check(heif_context_get_primary_image_handle(context.get(), &raw_handle), file_name);
  const std::unique_ptr<heif_image_handle, Release> handle(raw_handle);
  const bool deep = heif_image_handle_get_luma_bits_per_pixel(handle.get()) > 8;
  heif_image* raw_image = nullptr;
  Check(heif_decode_image(handle.get(),
                          &raw_image,
                          heif_colorspace_RGB,
                          deep ? heif_chroma_interleaved_RRGGBB_LE : heif_chroma_interleaved_RGB,
                          nullptr),
        file_name);
  const std::unique_ptr<heif_image, Release> image(raw_image);
  const int width = heif_image_get_width(image.get(), heif_channel_interleaved);
  const int height = heif_image_get_height(image.get(), heif_channel_interleaved);
  int stride = 0;
  const uint8_t* data =
      heif_image_get_plane_readonly(image.get(), heif_channel_interleaved, &stride);
  if (data == nullptr || width < 1 || height < 1) return {};
  cv::Mat mat(height, width, deep ? CV_16UC3 : CV_8UC3);
  if (deep) {
    const int bits = heif_image_get_bits_per_pixel_range(image.get(), heif_channel_interleaved);
    CopyRows<uint16_t>(data, stride, std::clamp(bits, 9, 16), &mat);
  } else {
    CopyRows<uint8_t>(data, stride, 8, &mat);
  }
  return mat;
}

}  // namespace color3d

#else

namespace color3d {

cv::Mat DecodeHeif(std::string_view, const std::string& file_name, const ImageInfo&) {
  throw InvalidArgument("{} is a HEIC picture, which this build cannot read; convert it to JPEG",
                        file_name);
}

}  // namespace color3d
#endif
