#include "tests/support/formats/tone_film.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/log.h>
#include <libavutil/opt.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

namespace color3d {
namespace {

constexpr int kFrames = 3;

void Require(bool ok, const char* what) {
  if (!ok) throw std::runtime_error(std::string("film of tones: ") + what);
}

// The tones in the stream's format, converted by FFmpeg's libraries.
AVFrame* Picture(const ToneStream& stream, AVPixelFormat format) {
  AVFrame* rgb = av_frame_alloc();
  AVFrame* frame = av_frame_alloc();
  rgb->format = AV_PIX_FMT_RGB48;
  frame->format = format;
  for (AVFrame* each : {rgb, frame}) {
    each->width = stream.width;
    each->height = stream.height;
    Require(av_frame_get_buffer(each, 0) >= 0, "no memory");
  }
  for (int y = 0; y < stream.height; ++y) {
    auto* row = reinterpret_cast<uint16_t*>(rgb->data[0] + y * rgb->linesize[0]);
    for (int x = 0; x < stream.width; ++x) {
      const double tone = stream.tone(static_cast<double>(x) / (stream.width - 1));
      std::fill_n(row + 3 * x, 3, static_cast<uint16_t>(std::lround(65535.0 * tone)));
    }
  }
  SwsContext* converter = sws_getContext(stream.width,
                                         stream.height,
                                         AV_PIX_FMT_RGB48,
                                         stream.width,
                                         stream.height,
                                         format,
                                         SWS_BICUBIC | SWS_ACCURATE_RND,
                                         nullptr,
                                         nullptr,
                                         nullptr);
  Require(converter != nullptr, "no conversion");
  int *from = nullptr, *to = nullptr;
  int from_full = 0, to_full = 0, brightness = 0, contrast = 0, saturation = 0;
  sws_getColorspaceDetails(
      converter, &from, &from_full, &to, &to_full, &brightness, &contrast, &saturation);
  if (!stream.range.empty()) to_full = stream.range == "pc" ? 1 : 0;
  sws_setColorspaceDetails(
      converter, from, from_full, to, to_full, brightness, contrast, saturation);
  sws_scale(converter, rgb->data, rgb->linesize, 0, stream.height, frame->data, frame->linesize);
  sws_freeContext(converter);
  av_frame_free(&rgb);
  return frame;
}

AVCodecContext* OpenEncoder(const ToneStream& stream, const AVOutputFormat& container) {
  const AVCodec* encoder = avcodec_find_encoder_by_name(stream.encoder.c_str());
  if (encoder == nullptr) return nullptr;
  AVCodecContext* codec = avcodec_alloc_context3(encoder);
  codec->width = stream.width;
  codec->height = stream.height;
  codec->pix_fmt = av_get_pix_fmt(stream.pixel_format.c_str());
  codec->time_base = {1, 25};
  codec->framerate = {25, 1};
  codec->thread_count = 1;
  codec->gop_size = 1;
  codec->strict_std_compliance = FF_COMPLIANCE_EXPERIMENTAL;
  codec->flags |= AV_CODEC_FLAG_QSCALE;
  codec->global_quality = FF_QP2LAMBDA;
  const auto number = [](const std::string& name, int (*from_name)(const char*), int unknown) {
    if (name.empty()) return unknown;
    const int value = from_name(name.c_str());
    Require(value >= 0, "unknown name");
    return value;
  };
  codec->color_range = static_cast<AVColorRange>(
      number(stream.range, &av_color_range_from_name, AVCOL_RANGE_UNSPECIFIED));
  codec->color_trc = static_cast<AVColorTransferCharacteristic>(
      number(stream.transfer, &av_color_transfer_from_name, AVCOL_TRC_UNSPECIFIED));
  codec->color_primaries = static_cast<AVColorPrimaries>(
      number(stream.primaries, &av_color_primaries_from_name, AVCOL_PRI_UNSPECIFIED));
  if (container.flags & AVFMT_GLOBALHEADER) codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  if (stream.encoder == "libx265") av_opt_set(codec->priv_data, "x265-params", "log-level=0", 0);
  Require(avcodec_open2(codec, encoder, nullptr) == 0, "the encoder does not open");
  return codec;
}

void Write(AVCodecContext* codec, AVStream* stream, AVFormatContext* film) {
  AVPacket* packet = av_packet_alloc();
  while (avcodec_receive_packet(codec, packet) == 0) {
    packet->stream_index = stream->index;
    if (packet->duration == 0) packet->duration = 1;
    av_packet_rescale_ts(packet, codec->time_base, stream->time_base);
    Require(av_interleaved_write_frame(film, packet) >= 0, "a picture is not written");
  }
  av_packet_free(&packet);
}

}  // namespace

bool WriteToneFilm(const std::filesystem::path& file, const std::vector<ToneStream>& streams) {
  av_log_set_level(AV_LOG_FATAL);
  AVFormatContext* film = nullptr;
  Require(avformat_alloc_output_context2(&film, nullptr, nullptr, file.c_str()) >= 0,
          "no container");
  film->strict_std_compliance = FF_COMPLIANCE_EXPERIMENTAL;
  std::vector<AVCodecContext*> codecs;
  for (const ToneStream& stream : streams) {
    codecs.push_back(OpenEncoder(stream, *film->oformat));
    if (codecs.back() == nullptr) {
      for (AVCodecContext*& codec : codecs) avcodec_free_context(&codec);
      avformat_free_context(film);
      return false;
    }
    AVStream* of_film = avformat_new_stream(film, nullptr);
    Require(avcodec_parameters_from_context(of_film->codecpar, codecs.back()) >= 0, "parameters");
    of_film->time_base = codecs.back()->time_base;
    of_film->avg_frame_rate = {25, 1};
    if (stream.is_default) of_film->disposition |= AV_DISPOSITION_DEFAULT;
  }
  Require(avio_open(&film->pb, file.c_str(), AVIO_FLAG_WRITE) >= 0, "no file");
  Require(avformat_write_header(film, nullptr) >= 0, "no header");
  for (size_t i = 0; i < streams.size(); ++i) {
    AVFrame* frame = Picture(streams[i], codecs[i]->pix_fmt);
    frame->color_range = codecs[i]->color_range;
    frame->color_trc = codecs[i]->color_trc;
    frame->color_primaries = codecs[i]->color_primaries;
    frame->quality = codecs[i]->global_quality;
    for (int number = 0; number < kFrames; ++number) {
      frame->pts = number;
      Require(avcodec_send_frame(codecs[i], frame) == 0, "a frame is refused");
      Write(codecs[i], film->streams[i], film);
    }
    avcodec_send_frame(codecs[i], nullptr);
    Write(codecs[i], film->streams[i], film);
    av_frame_free(&frame);
  }
  Require(av_write_trailer(film) >= 0, "no end");
  avio_closep(&film->pb);
  for (AVCodecContext*& codec : codecs) avcodec_free_context(&codec);
  avformat_free_context(film);
  return true;
}

}  // namespace color3d
