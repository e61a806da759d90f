#include "tests/support/formats/movie_reader.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <memory>
#include <stdexcept>

#include "core/base/files.h"

namespace color3d {
namespace {

void Require(bool ok, const char* what) {
  if (!ok) throw std::runtime_error(std::string("the movie cannot be read: ") + what);
}

Image ToSrgb(const AVFrame& frame) {
  SwsContext* converter = sws_getContext(frame.width,
                                         frame.height,
                                         static_cast<AVPixelFormat>(frame.format),
                                         frame.width,
                                         frame.height,
                                         AV_PIX_FMT_RGB24,
                                         SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT,
                                         nullptr,
                                         nullptr,
                                         nullptr);
  Require(converter != nullptr, "no conversion");
  // The tags of the file determine its colours.
  const int* matrix =
      sws_getCoefficients(frame.colorspace == AVCOL_SPC_BT709 ? SWS_CS_ITU709 : SWS_CS_ITU601);
  sws_setColorspaceDetails(converter,
                           matrix,
                           frame.color_range == AVCOL_RANGE_JPEG,
                           sws_getCoefficients(SWS_CS_DEFAULT),
                           1,
                           0,
                           1 << 16,
                           1 << 16);
  std::vector<uint8_t> rgb(static_cast<size_t>(frame.width) * frame.height * 3);
  uint8_t* rows[] = {rgb.data()};
  const int strides[] = {3 * frame.width};
  sws_scale(converter, frame.data, frame.linesize, 0, frame.height, rows, strides);
  sws_freeContext(converter);
  Image image(frame.width, frame.height, 3);
  for (size_t i = 0; i < image.PlaneSize(); ++i) {
    for (int c = 0; c < 3; ++c) image.Plane(c)[i] = rgb[3 * i + c] / 255.0f;
  }
  return image;
}

void Receive(AVCodecContext* codec, AVFrame* frame, double tick, ReadMovie* movie) {
  while (avcodec_receive_frame(codec, frame) == 0) {
    movie->times.push_back(frame->best_effort_timestamp * tick);
    movie->tagged_bt709 =
        frame->colorspace == AVCOL_SPC_BT709 && frame->color_primaries == AVCOL_PRI_BT709 &&
        frame->color_trc == AVCOL_TRC_BT709 && frame->color_range == AVCOL_RANGE_MPEG;
    movie->frames.push_back(ToSrgb(*frame));
  }
}

}  // namespace

ReadMovie DecodeMovie(const std::filesystem::path& file) {
  AVFormatContext* container = nullptr;
  Require(avformat_open_input(&container, file.c_str(), nullptr, nullptr) == 0, "no container");
  Require(avformat_find_stream_info(container, nullptr) >= 0, "no streams");
  AVStream* stream = container->streams[0];
  Require(stream->codecpar->codec_type == AVMEDIA_TYPE_VIDEO, "its first stream is no picture");
  const AVCodec* decoder = avcodec_find_decoder(stream->codecpar->codec_id);
  Require(decoder != nullptr, "no decoder");
  AVCodecContext* codec = avcodec_alloc_context3(decoder);
  Require(avcodec_parameters_to_context(codec, stream->codecpar) >= 0, "no parameters");
  Require(avcodec_open2(codec, decoder, nullptr) == 0, "the decoder does not open");
  ReadMovie movie;
  movie.codec = decoder->name;
  movie.pixel_format = av_get_pix_fmt_name(codec->pix_fmt);
  movie.width = codec->width;
  movie.height = codec->height;
  movie.seconds = static_cast<double>(container->duration) / AV_TIME_BASE;
  movie.frames_per_second = av_q2d(stream->avg_frame_rate);
  AVPacket* packet = av_packet_alloc();
  AVFrame* frame = av_frame_alloc();
  const double tick = av_q2d(stream->time_base);
  while (av_read_frame(container, packet) >= 0) {
    const bool is_picture = packet->stream_index == stream->index;
    if (is_picture) Require(avcodec_send_packet(codec, packet) == 0, "a packet is refused");
    av_packet_unref(packet);
    if (!is_picture) continue;
    Receive(codec, frame, tick, &movie);
  }
  avcodec_send_packet(codec, nullptr);
  Receive(codec, frame, tick, &movie);
  av_frame_free(&frame);
  av_packet_free(&packet);
  avcodec_free_context(&codec);
  avformat_close_input(&container);
  const std::string bytes = ReadFile(file);
  movie.index_first = bytes.find("moov") < bytes.find("mdat");
  return movie;
}

}  // namespace color3d
