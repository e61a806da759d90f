#include "core/video/frame_converter.h"

extern "C" {
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kFlags = SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT;

}  // namespace

bool IsGray(AVPixelFormat format) {
  const AVPixFmtDescriptor* facts = av_pix_fmt_desc_get(format);
  return facts != nullptr && facts->nb_components <= 2 &&
         (facts->flags & (AV_PIX_FMT_FLAG_PAL | AV_PIX_FMT_FLAG_RGB | AV_PIX_FMT_FLAG_BITSTREAM |
                          AV_PIX_FMT_FLAG_HWACCEL)) == 0;
}

bool CanConvert(AVPixelFormat format) { return sws_isSupportedInput(format) > 0; }

void FrameConverter::FreeConverter::operator()(SwsContext* converter) const {
  sws_freeContext(converter);
}

void FrameConverter::Prepare(const Shape& shape) {
  if (converter_ && shape == shape_) return;
  const auto format = static_cast<AVPixelFormat>(shape.format);
  converter_.reset(sws_getContext(shape.width,
                                  shape.lines,
                                  format,
                                  shape.out_width,
                                  shape.out_height,
                                  AV_PIX_FMT_RGB48,
                                  kFlags,
                                  nullptr,
                                  nullptr,
                                  nullptr));
  if (!converter_) {
    const char* name = av_get_pix_fmt_name(format);
    throw Error(ErrorCode::kDataLoss,
                "pixels of the format {} cannot be converted",
                name != nullptr ? name : "unknown");
  }
  shape_ = shape;
  // A new converter has the default range of its format.
  int *matrix = nullptr, *out_matrix = nullptr;
  int is_full = 0, out_is_full = 0, brightness = 0, contrast = 0, saturation = 0;
  sws_getColorspaceDetails(converter_.get(),
                           &matrix,
                           &is_full,
                           &out_matrix,
                           &out_is_full,
                           &brightness,
                           &contrast,
                           &saturation);
  is_full_ = is_full != 0 || IsGray(format);
}

Image FrameConverter::Convert(const AVFrame& frame, AVColorRange range, int width, int height) {
  // Uses every second line of interlaced frames, those of one field.
  const int step = frame.interlaced_frame != 0 && frame.height > 1 ? 2 : 1;
  const int lines = frame.height / step;
  Prepare({frame.width, lines, frame.format, width, height});
  const bool is_full = range == AVCOL_RANGE_UNSPECIFIED ? is_full_ : range == AVCOL_RANGE_JPEG;
  constexpr int kOne = 1 << 16;
  // FFmpeg's and the frame's numbers of matrices agree. Y'CbCr frames that claim RGB get the
  // default.
  const int matrix = frame.colorspace == AVCOL_SPC_RGB ? SWS_CS_DEFAULT : frame.colorspace;
  sws_setColorspaceDetails(converter_.get(),
                           sws_getCoefficients(matrix),
                           is_full ? 1 : 0,
                           sws_getCoefficients(SWS_CS_DEFAULT),
                           1,
                           0,
                           kOne,
                           kOne);
  const uint8_t* data[4];
  int strides[4];
  for (int i = 0; i < 4; ++i) {
    data[i] = frame.data[i];
    strides[i] = step * frame.linesize[i];
  }
  rgb_.resize(static_cast<size_t>(width) * height * 3);
  uint8_t* rows[] = {reinterpret_cast<uint8_t*>(rgb_.data())};
  const int row_bytes[] = {6 * width};
  sws_scale(converter_.get(), data, strides, 0, lines, rows, row_bytes);
  Image image(width, height, 3);
  for (size_t i = 0; i < image.PlaneSize(); ++i) {
    for (int c = 0; c < 3; ++c) image.Plane(c)[i] = static_cast<float>(rgb_[3 * i + c]) / 65535.0f;
  }
  return image;
}

}  // namespace color3d
