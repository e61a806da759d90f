#include "tests/support/formats/interlaced_film.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace color3d {
namespace {

void Require(bool ok, const char* what) {
  if (!ok) throw std::runtime_error(std::string("interlaced film: ") + what);
}

void Draw(const FieldGray& gray, int number, AVFrame* frame) {
  for (int y = 0; y < frame->height; ++y) {
    uint8_t* row = frame->data[0] + static_cast<ptrdiff_t>(y) * frame->linesize[0];
    for (int x = 0; x < frame->width; ++x) {
      row[x] = static_cast<uint8_t>(std::lround(16.0 + 219.0 * gray(number, y % 2, x)));
    }
  }
  for (const int plane : {1, 2}) {
    std::fill_n(frame->data[plane],
                static_cast<ptrdiff_t>(frame->linesize[plane]) * frame->height / 2,
                128);
  }
}

void WriteCoded(AVCodecContext* codec, AVStream* stream, AVFormatContext* film) {
  AVPacket* packet = av_packet_alloc();
  while (avcodec_receive_packet(codec, packet) == 0) {
    packet->duration = 1;
    av_packet_rescale_ts(packet, codec->time_base, stream->time_base);
    packet->stream_index = stream->index;
    Require(av_interleaved_write_frame(film, packet) >= 0, "a picture is not written");
  }
  av_packet_free(&packet);
}

}  // namespace

void WriteInterlacedFilm(
    const std::filesystem::path& file, int width, int height, int frames, const FieldGray& gray) {
  const AVCodec* encoder = avcodec_find_encoder(AV_CODEC_ID_MPEG2VIDEO);
  Require(encoder != nullptr, "no encoder");
  AVFormatContext* film = nullptr;
  Require(avformat_alloc_output_context2(&film, nullptr, nullptr, file.c_str()) >= 0, "no output");
  AVCodecContext* codec = avcodec_alloc_context3(encoder);
  codec->width = width;
  codec->height = height;
  codec->pix_fmt = AV_PIX_FMT_YUV420P;
  codec->time_base = {1, 25};
  codec->framerate = {25, 1};
  codec->gop_size = 5;
  codec->flags |= AV_CODEC_FLAG_INTERLACED_DCT | AV_CODEC_FLAG_INTERLACED_ME | AV_CODEC_FLAG_QSCALE;
  codec->global_quality = 2 * FF_QP2LAMBDA;
  if (film->oformat->flags & AVFMT_GLOBALHEADER) codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  Require(avcodec_open2(codec, encoder, nullptr) == 0, "the encoder does not open");
  AVStream* stream = avformat_new_stream(film, nullptr);
  Require(avcodec_parameters_from_context(stream->codecpar, codec) >= 0, "parameters");
  stream->time_base = codec->time_base;
  Require(avio_open(&film->pb, file.c_str(), AVIO_FLAG_WRITE) >= 0, "no file");
  Require(avformat_write_header(film, nullptr) >= 0, "no header");
  for (int i = 0; i < frames; ++i) {
    AVFrame* frame = av_frame_alloc();
    frame->format = codec->pix_fmt;
    frame->width = width;
    frame->height = height;
    Require(av_frame_get_buffer(frame, 0) >= 0, "no memory");
    frame->pts = i;
    frame->interlaced_frame = 1;
    frame->top_field_first = 1;
    Draw(gray, i, frame);
    Require(avcodec_send_frame(codec, frame) == 0, "a frame is refused");
    WriteCoded(codec, stream, film);
    av_frame_free(&frame);
  }
  avcodec_send_frame(codec, nullptr);
  WriteCoded(codec, stream, film);
  Require(av_write_trailer(film) >= 0, "no end");
  avio_closep(&film->pb);
  avcodec_free_context(&codec);
  avformat_free_context(film);
}

}  // namespace color3d
