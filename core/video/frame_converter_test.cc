// Every pixel format that FFmpeg's libraries know, against their own conversion.
#include "core/video/frame_converter.h"

#include <gtest/gtest.h>

extern "C" {
#include <libavutil/imgutils.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <cmath>
#include <string>

namespace color3d {
namespace {

constexpr int kWidth = 64, kHeight = 16;

using Frame = std::unique_ptr<AVFrame, FreeFrame>;

Frame EmptyFrame(AVPixelFormat format) {
  Frame frame(av_frame_alloc());
  frame->format = format;
  frame->width = kWidth;
  frame->height = kHeight;
  EXPECT_GE(av_frame_get_buffer(frame.get(), 0), 0);
  for (const AVBufferRef* buffer : frame->buf) {
    if (buffer != nullptr) std::fill_n(buffer->data, buffer->size, uint8_t{0});
  }
  return frame;
}

bool IsFloat(const AVPixFmtDescriptor& facts) { return (facts.flags & AV_PIX_FMT_FLAG_FLOAT) != 0; }

// A gradient along both axes, converted by FFmpeg's libraries; arbitrary bytes for formats that
// they only read.
Frame Pattern(AVPixelFormat format) {
  Frame frame = EmptyFrame(format);
  if (sws_isSupportedOutput(format) <= 0) {
    uint32_t state = 1;
    for (const AVBufferRef* buffer : frame->buf) {
      for (size_t i = 0; buffer != nullptr && i < buffer->size; ++i) {
        state = state * 1664525u + 1013904223u;
        buffer->data[i] = static_cast<uint8_t>(state >> 24);
      }
    }
    return frame;
  }
  Frame colors = EmptyFrame(AV_PIX_FMT_RGB48);
  for (int y = 0; y < kHeight; ++y) {
    auto* row = reinterpret_cast<uint16_t*>(colors->data[0] + y * colors->linesize[0]);
    for (int x = 0; x < kWidth; ++x) {
      row[3 * x] = static_cast<uint16_t>(65535 * x / (kWidth - 1));
      row[3 * x + 1] = static_cast<uint16_t>(65535 * y / (kHeight - 1));
      row[3 * x + 2] = static_cast<uint16_t>(65535 * (kWidth - 1 - x) / (kWidth - 1));
    }
  }
  SwsContext* writer = sws_getContext(kWidth,
                                      kHeight,
                                      AV_PIX_FMT_RGB48,
                                      kWidth,
                                      kHeight,
                                      format,
                                      SWS_BICUBIC,
                                      nullptr,
                                      nullptr,
                                      nullptr);
  EXPECT_NE(writer, nullptr);
  sws_scale(writer, colors->data, colors->linesize, 0, kHeight, frame->data, frame->linesize);
  sws_freeContext(writer);
  return frame;
}

// Converts as `ffmpeg -pix_fmt rgb48`: with the range that the frame states, else the format's own.
Image Expected(const AVFrame& frame) {
  const auto format = static_cast<AVPixelFormat>(frame.format);
  SwsContext* reader = sws_getContext(kWidth,
                                      kHeight,
                                      format,
                                      kWidth,
                                      kHeight,
                                      AV_PIX_FMT_RGB48,
                                      SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT,
                                      nullptr,
                                      nullptr,
                                      nullptr);
  EXPECT_NE(reader, nullptr);
  const AVPixFmtDescriptor& facts = *av_pix_fmt_desc_get(format);
  int *from = nullptr, *to = nullptr;
  int from_full = 0, to_full = 0, brightness = 0, contrast = 0, saturation = 0;
  sws_getColorspaceDetails(
      reader, &from, &from_full, &to, &to_full, &brightness, &contrast, &saturation);
  // FFmpeg's libraries do not treat grey floating-point formats as full range.
  if (IsGray(format) && IsFloat(facts)) from_full = 1;
  if (frame.color_range != AVCOL_RANGE_UNSPECIFIED) {
    from_full = frame.color_range == AVCOL_RANGE_JPEG ? 1 : 0;
  }
  sws_setColorspaceDetails(reader, from, from_full, to, to_full, brightness, contrast, saturation);
  std::vector<uint16_t> rgb(3 * kWidth * kHeight);
  uint8_t* rows[] = {reinterpret_cast<uint8_t*>(rgb.data())};
  const int strides[] = {6 * kWidth};
  sws_scale(reader, frame.data, frame.linesize, 0, kHeight, rows, strides);
  sws_freeContext(reader);
  Image image(kWidth, kHeight, 3);
  for (size_t i = 0; i < image.PlaneSize(); ++i) {
    for (int c = 0; c < 3; ++c) image.Plane(c)[i] = static_cast<float>(rgb[3 * i + c]) / 65535.0f;
  }
  return image;
}

double Difference(const Image& one, const Image& other) {
  double most = 0.0;
  for (size_t i = 0; i < one.data.size(); ++i) {
    most = std::max<double>(most, std::abs(one.data[i] - other.data[i]));
  }
  return most;
}

std::vector<AVPixelFormat> Formats() {
  std::vector<AVPixelFormat> formats;
  for (const AVPixFmtDescriptor* facts = av_pix_fmt_desc_next(nullptr); facts != nullptr;
       facts = av_pix_fmt_desc_next(facts)) {
    const AVPixelFormat format = av_pix_fmt_desc_get_id(facts);
    if (CanConvert(format)) formats.push_back(format);
  }
  return formats;
}

// Formats with integer luma.
std::vector<AVPixelFormat> LumaFormats() {
  std::vector<AVPixelFormat> formats;
  for (const AVPixelFormat format : Formats()) {
    const AVPixFmtDescriptor& facts = *av_pix_fmt_desc_get(format);
    if ((facts.flags & (AV_PIX_FMT_FLAG_RGB | AV_PIX_FMT_FLAG_PAL | AV_PIX_FMT_FLAG_BITSTREAM |
                        AV_PIX_FMT_FLAG_BAYER | AV_PIX_FMT_FLAG_FLOAT)) == 0 &&
        !std::string(facts.name).starts_with("xyz")) {
      formats.push_back(format);
    }
  }
  return formats;
}

std::string NameOf(const testing::TestParamInfo<AVPixelFormat>& format) {
  return av_get_pix_fmt_name(format.param);
}

class FrameConverterTest : public testing::TestWithParam<AVPixelFormat> {
 protected:
  const AVPixFmtDescriptor& facts() const { return *av_pix_fmt_desc_get(GetParam()); }

  // A grey frame of one luma, `share` of the way from black to white.
  Frame Plain(double share, bool is_full) {
    Frame frame = EmptyFrame(GetParam());
    for (int c = 0; c < facts().nb_components; ++c) {
      const bool is_chroma = facts().nb_components > 2 && (c == 1 || c == 2);
      const int depth = facts().comp[c].depth;
      const double most = (1 << depth) - 1, unit = 1 << (depth - 8);
      const double value = is_chroma ? 128 * unit
                           : c > 0   ? most
                           : is_full ? share * most
                                     : (16 + 219 * share) * unit;
      const int width = is_chroma ? AV_CEIL_RSHIFT(kWidth, facts().log2_chroma_w) : kWidth;
      const int height = is_chroma ? AV_CEIL_RSHIFT(kHeight, facts().log2_chroma_h) : kHeight;
      const std::vector<uint16_t> line(width, static_cast<uint16_t>(std::lround(value)));
      for (int y = 0; y < height; ++y) {
        av_write_image_line(line.data(), frame->data, frame->linesize, &facts(), 0, y, c, width);
      }
    }
    return frame;
  }
};

class LumaFormatTest : public FrameConverterTest {};

TEST_P(FrameConverterTest, AgreesWithFfmpeg) {
  FrameConverter converter;
  const Frame frame = Pattern(GetParam());
  for (const AVColorRange range :
       {AVCOL_RANGE_UNSPECIFIED, AVCOL_RANGE_MPEG, AVCOL_RANGE_JPEG, AVCOL_RANGE_UNSPECIFIED}) {
    frame->color_range = range;
    EXPECT_LT(Difference(converter.Convert(*frame, frame->color_range, kWidth, kHeight),
                         Expected(*frame)),
              1e-4)
        << av_color_range_name(range);
  }
}

// Black, grey and white by the standards, without FFmpeg's conversions.
TEST_P(LumaFormatTest, TonesMatchFormat) {
  const bool is_jpeg = std::string(facts().name).starts_with("yuvj");
  FrameConverter converter;
  const struct {
    AVColorRange range;
    bool is_full;
  } ranges[] = {{AVCOL_RANGE_UNSPECIFIED, IsGray(GetParam()) || is_jpeg},
                {AVCOL_RANGE_MPEG, false},
                {AVCOL_RANGE_JPEG, true}};
  for (const auto& range : ranges) {
    for (const double share : {0.0, 0.25, 0.5, 1.0}) {
      const Frame frame = Plain(share, range.is_full);
      frame->color_range = range.range;
      const Image image = converter.Convert(*frame, frame->color_range, kWidth, kHeight);
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(image.At(c, kHeight / 2, kWidth / 2), share, 0.007)
            << av_color_range_name(range.range) << " channel " << c;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(EveryFormat, FrameConverterTest, testing::ValuesIn(Formats()), NameOf);
INSTANTIATE_TEST_SUITE_P(EveryFormat, LumaFormatTest, testing::ValuesIn(LumaFormats()), NameOf);

TEST(FrameConverter, KnowsUnsupportedFormats) {
  EXPECT_FALSE(CanConvert(AV_PIX_FMT_VAAPI));
  EXPECT_FALSE(CanConvert(AV_PIX_FMT_NONE));
  EXPECT_GT(Formats().size(), 150u);
  EXPECT_GT(LumaFormats().size(), 80u);
}

}  // namespace
}  // namespace color3d
