#include "tests/support/formats/sound_film.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace color3d {
namespace {

void Require(bool ok, const char* what) {
  if (!ok) throw std::runtime_error(std::string("sound: ") + what);
}

AVFormatContext* Opened(const std::filesystem::path& film) {
  AVFormatContext* container = nullptr;
  Require(avformat_open_input(&container, film.c_str(), nullptr, nullptr) == 0, "no container");
  Require(avformat_find_stream_info(container, nullptr) >= 0, "no streams");
  return container;
}

void PutSample(AVFrame* frame, int channel, int channels, int i, double value) {
  const auto format = static_cast<AVSampleFormat>(frame->format);
  const bool planar = av_sample_fmt_is_planar(format) != 0;
  uint8_t* data = frame->extended_data[planar ? channel : 0];
  const int at = planar ? i : i * channels + channel;
  switch (av_get_packed_sample_fmt(format)) {
    case AV_SAMPLE_FMT_FLT:
      reinterpret_cast<float*>(data)[at] = static_cast<float>(value);
      return;
    case AV_SAMPLE_FMT_S16:
      reinterpret_cast<int16_t*>(data)[at] = static_cast<int16_t>(32767 * value);
      return;
    case AV_SAMPLE_FMT_S32:
      reinterpret_cast<int32_t*>(data)[at] = static_cast<int32_t>(2147483647.0 * value);
      return;
    default:
      throw std::runtime_error("sound: samples of another format");
  }
}

void WriteCoded(AVCodecContext* codec, AVStream* stream, AVFormatContext* movie) {
  AVPacket* packet = av_packet_alloc();
  while (avcodec_receive_packet(codec, packet) == 0) {
    av_packet_rescale_ts(packet, codec->time_base, stream->time_base);
    packet->stream_index = stream->index;
    Require(av_interleaved_write_frame(movie, packet) >= 0, "a packet is not written");
  }
  av_packet_free(&packet);
}

void WriteSound(const GivenSound& sound,
                AVCodecContext* codec,
                AVStream* stream,
                AVFormatContext* movie) {
  const int total = static_cast<int>(sound.seconds * sound.sample_rate);
  const int size = codec->frame_size > 0 ? codec->frame_size : 1024;
  for (int begin = 0; begin < total; begin += size) {
    AVFrame* frame = av_frame_alloc();
    frame->format = codec->sample_fmt;
    frame->sample_rate = codec->sample_rate;
    av_channel_layout_copy(&frame->ch_layout, &codec->ch_layout);
    frame->nb_samples = std::min(size, total - begin);
    Require(av_frame_get_buffer(frame, 0) >= 0, "no memory");
    frame->pts = std::llround(sound.begin_s * sound.sample_rate) + begin;
    for (int i = 0; i < frame->nb_samples; ++i) {
      const double time_s = sound.begin_s + static_cast<double>(begin + i) / sound.sample_rate;
      for (int c = 0; c < sound.channels; ++c) {
        PutSample(frame, c, sound.channels, i, sound.level(time_s));
      }
    }
    Require(avcodec_send_frame(codec, frame) == 0, "a frame is refused");
    WriteCoded(codec, stream, movie);
    av_frame_free(&frame);
  }
  avcodec_send_frame(codec, nullptr);
  WriteCoded(codec, stream, movie);
}

}  // namespace

void AddSound(const std::filesystem::path& film,
              const GivenSound& sound,
              const std::filesystem::path& out) {
  AVFormatContext* from = Opened(film);
  AVFormatContext* to = nullptr;
  Require(avformat_alloc_output_context2(&to, nullptr, nullptr, out.c_str()) >= 0, "no output");
  AVStream* pictures = avformat_new_stream(to, nullptr);
  Require(avcodec_parameters_copy(pictures->codecpar, from->streams[0]->codecpar) >= 0, "pictures");
  pictures->codecpar->codec_tag = 0;
  pictures->time_base = from->streams[0]->time_base;
  const AVCodec* encoder = avcodec_find_encoder_by_name(sound.encoder.c_str());
  Require(encoder != nullptr, "the encoder is missing");
  AVCodecContext* codec = avcodec_alloc_context3(encoder);
  codec->sample_rate = sound.sample_rate;
  codec->sample_fmt = encoder->sample_fmts[0];
  codec->time_base = {1, sound.sample_rate};
  av_channel_layout_default(&codec->ch_layout, sound.channels);
  codec->bit_rate = 128000;
  codec->strict_std_compliance = FF_COMPLIANCE_EXPERIMENTAL;
  if (to->oformat->flags & AVFMT_GLOBALHEADER) codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  Require(avcodec_open2(codec, encoder, nullptr) == 0, "the encoder does not open");
  AVStream* heard = avformat_new_stream(to, nullptr);
  Require(avcodec_parameters_from_context(heard->codecpar, codec) >= 0, "parameters");
  heard->time_base = codec->time_base;
  Require(avio_open(&to->pb, out.c_str(), AVIO_FLAG_WRITE) >= 0, "no file");
  Require(avformat_write_header(to, nullptr) >= 0, "no header");
  AVPacket* packet = av_packet_alloc();
  while (av_read_frame(from, packet) >= 0) {
    av_packet_rescale_ts(packet, from->streams[0]->time_base, pictures->time_base);
    packet->stream_index = pictures->index;
    packet->pos = -1;
    Require(av_interleaved_write_frame(to, packet) >= 0, "a picture is not written");
  }
  av_packet_free(&packet);
  WriteSound(sound, codec, heard, to);
  Require(av_write_trailer(to) >= 0, "no end");
  avio_closep(&to->pb);
  avcodec_free_context(&codec);
  avformat_free_context(to);
  avformat_close_input(&from);
}

HeardSound HearFilm(const std::filesystem::path& film) {
  HeardSound heard;
  AVFormatContext* container = Opened(film);
  AVStream* stream = nullptr;
  for (unsigned i = 0; i < container->nb_streams; ++i) {
    AVStream* each = container->streams[i];
    if (each->codecpar->codec_type == AVMEDIA_TYPE_AUDIO && stream == nullptr) stream = each;
  }
  if (stream == nullptr) {
    avformat_close_input(&container);
    return heard;
  }
  const AVCodec* decoder = avcodec_find_decoder(stream->codecpar->codec_id);
  AVCodecContext* codec = avcodec_alloc_context3(decoder);
  Require(avcodec_parameters_to_context(codec, stream->codecpar) >= 0, "parameters");
  codec->pkt_timebase = stream->time_base;
  codec->request_sample_fmt = AV_SAMPLE_FMT_FLTP;
  Require(avcodec_open2(codec, decoder, nullptr) == 0, "the decoder does not open");
  heard.codec = avcodec_get_name(stream->codecpar->codec_id);
  heard.sample_rate = codec->sample_rate;
  heard.channels = codec->ch_layout.nb_channels;
  AVPacket* packet = av_packet_alloc();
  AVFrame* frame = av_frame_alloc();
  const auto receive = [&] {
    while (avcodec_receive_frame(codec, frame) == 0) {
      Require(frame->format == AV_SAMPLE_FMT_FLTP, "samples of another format");
      const double time_s =
          static_cast<double>(frame->best_effort_timestamp) * av_q2d(stream->time_base);
      const int64_t at = std::llround(time_s * heard.sample_rate);
      const auto* samples = reinterpret_cast<const float*>(frame->extended_data[0]);
      for (int i = 0; i < frame->nb_samples; ++i) {
        if (at + i < 0) continue;
        heard.samples.resize(std::max(heard.samples.size(), static_cast<size_t>(at + i + 1)));
        heard.samples[at + i] = samples[i];
      }
    }
  };
  while (av_read_frame(container, packet) >= 0) {
    if (packet->stream_index == stream->index) {
      avcodec_send_packet(codec, packet);
      receive();
    }
    av_packet_unref(packet);
  }
  avcodec_send_packet(codec, nullptr);
  receive();
  av_frame_free(&frame);
  av_packet_free(&packet);
  avcodec_free_context(&codec);
  avformat_close_input(&container);
  return heard;
}

}  // namespace color3d
