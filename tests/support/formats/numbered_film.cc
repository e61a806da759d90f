#include "tests/support/formats/numbered_film.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/log.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace color3d {
namespace {

constexpr int kWidth = 96, kHeight = 64, kBits = 8, kBarHeight = 16;
constexpr int kBarWidth = kWidth / kBits;

void Require(bool ok, const char* what) {
  if (!ok) throw std::runtime_error(std::string("numbered film: ") + what);
}

int Luma(int number, int x, int y, bool is_flat) {
  if (y < kBarHeight) return number >> (x / kBarWidth) & 1 ? 200 : 40;
  if (is_flat) return 120;
  const auto grain = static_cast<uint32_t>((x + 2 * number) * 7919 + y * 104729) * 2654435761u;
  return static_cast<int>(128.0 +
                          60.0 * std::sin(0.11 * (x + 2 * number)) * std::cos(0.09 * (y - number)) +
                          static_cast<double>(grain >> 27));
}

struct Output {
  explicit Output(const std::filesystem::path& file) {
    av_log_set_level(AV_LOG_FATAL);
    Require(avformat_alloc_output_context2(&film, nullptr, nullptr, file.c_str()) >= 0,
            "no container");
    stream = avformat_new_stream(film, nullptr);
    stream->avg_frame_rate = {25, 1};
    Require(avio_open(&film->pb, file.c_str(), AVIO_FLAG_WRITE) >= 0, "no file");
  }

  void Begin(AVRational time_base) {
    stream->time_base = time_base;
    Require(avformat_write_header(film, nullptr) >= 0, "no header");
  }

  void Finish() {
    Require(av_write_trailer(film) >= 0, "no end");
    avio_closep(&film->pb);
    avformat_free_context(film);
  }

  AVFormatContext* film = nullptr;
  AVStream* stream = nullptr;
};

struct Coded {
  std::string bytes;
  int64_t pts = 0, dts = 0;
  int flags = 0;
};

void Write(const Coded& coded, int duration, AVRational time_base, Output* output) {
  AVPacket* packet = av_packet_alloc();
  Require(av_new_packet(packet, static_cast<int>(coded.bytes.size())) == 0, "no memory");
  std::memcpy(packet->data, coded.bytes.data(), coded.bytes.size());
  packet->pts = coded.pts;
  packet->dts = coded.dts;
  packet->flags = coded.flags;
  packet->duration = duration;
  av_packet_rescale_ts(packet, time_base, output->stream->time_base);
  Require(av_interleaved_write_frame(output->film, packet) >= 0, "a picture is not written");
  av_packet_free(&packet);
}

void Receive(AVCodecContext* codec, std::vector<Coded>* coded) {
  AVPacket* packet = av_packet_alloc();
  while (avcodec_receive_packet(codec, packet) == 0) {
    coded->push_back({std::string(reinterpret_cast<const char*>(packet->data), packet->size),
                      packet->pts,
                      packet->dts,
                      packet->flags});
    av_packet_unref(packet);
  }
  av_packet_free(&packet);
}

// Each B picture moves into the packet before it, and leaves a "not coded" picture in its place.
void Pack(std::vector<Coded>* coded) {
  for (size_t i = 1; i < coded->size(); ++i) {
    Coded& picture = (*coded)[i];
    if (picture.pts != picture.dts) continue;
    (*coded)[i - 1].bytes += picture.bytes;
    picture.bytes = std::string("\0\0\1\xb6\x50\x4f", 6);
  }
}

// Bits of H.264 (7.2, 9.1).
class Bits {
 public:
  void Put(uint32_t value, int count) {
    for (int i = count - 1; i >= 0; --i) {
      if (used_ % 8 == 0) bytes_.push_back('\0');
      bytes_.back() = static_cast<char>(bytes_.back() | (value >> i & 1) << (7 - used_ % 8));
      ++used_;
    }
  }
  void Golomb(uint32_t value) {
    int length = 0;
    while ((value + 1) >> (length + 1)) ++length;
    Put(0, length);
    Put(value + 1, length + 1);
  }
  void Align() {
    while (used_ % 8 != 0) Put(0, 1);
  }
  // A NAL unit with its start code.
  std::string Unit(int header) {
    Put(1, 1);
    Align();
    std::string unit("\0\0\0\1", 4);
    unit += static_cast<char>(header);
    int zeros = 0;
    for (const char byte : bytes_) {
      if (zeros >= 2 && static_cast<uint8_t>(byte) <= 3) {
        unit += '\3';
        zeros = 0;
      }
      unit += byte;
      zeros = byte == '\0' ? zeros + 1 : 0;
    }
    return unit;
  }

 private:
  std::string bytes_;
  int used_ = 0;
};

// Sequence and picture parameters (7.3.2): CAVLC, pictures of fields, order by numbers of 8 bits.
std::string Parameters() {
  Bits sequence;
  sequence.Put(77, 8);  // main profile
  sequence.Put(0, 8);
  sequence.Put(30, 8);
  for (const uint32_t value : {0, 0, 0, 4, 1}) sequence.Golomb(value);
  sequence.Put(0, 1);
  sequence.Golomb(kWidth / 16 - 1);
  sequence.Golomb(kHeight / 32 - 1);
  sequence.Put(0b00100, 5);
  Bits picture;
  picture.Golomb(0);
  picture.Golomb(0);
  picture.Put(0, 2);
  for (int i = 0; i < 3; ++i) picture.Golomb(0);
  picture.Put(0, 3);
  for (int i = 0; i < 3; ++i) picture.Golomb(0);
  picture.Put(0, 3);
  return sequence.Unit(0x67) + picture.Unit(0x68);
}

// A field of uncompressed macroblocks (I_PCM).
std::string Field(int number, int place, bool is_bottom) {
  const bool is_key = place == 0 && !is_bottom;
  Bits field;
  field.Golomb(0);
  field.Golomb(7);
  field.Golomb(0);
  field.Put(static_cast<uint32_t>(place), 4);
  field.Put(1, 1);
  field.Put(is_bottom, 1);
  if (is_key) field.Golomb(static_cast<uint32_t>(number % 2));
  field.Put(static_cast<uint32_t>(2 * place + is_bottom), 8);
  field.Put(0, is_key ? 2 : 1);
  field.Golomb(0);
  for (int block = 0; block < kWidth / 16 * (kHeight / 32); ++block) {
    field.Golomb(25);
    field.Align();
    const int x0 = block % (kWidth / 16) * 16, y0 = block / (kWidth / 16) * 16;
    for (int i = 0; i < 256; ++i) {
      const int y = 2 * (y0 + i / 16) + is_bottom;
      field.Put(static_cast<uint32_t>(Luma(number, x0 + i % 16, y, /*is_flat=*/true)), 8);
    }
    for (int i = 0; i < 128; ++i) field.Put(128, 8);
  }
  return field.Unit(is_key ? 0x65 : 0x61);
}

}  // namespace

bool WriteNumberedFilm(const std::filesystem::path& file, const NumberedFilm& film) {
  const AVCodec* encoder = avcodec_find_encoder_by_name(film.encoder.c_str());
  if (encoder == nullptr) return false;
  Output output(file);
  AVCodecContext* codec = avcodec_alloc_context3(encoder);
  codec->width = kWidth;
  codec->height = kHeight;
  codec->pix_fmt = AV_PIX_FMT_YUV420P;
  codec->time_base = {1, 25};
  codec->framerate = {25, 1};
  codec->gop_size = film.group;
  codec->max_b_frames = film.b_frames;
  codec->thread_count = 1;
  if (output.film->oformat->flags & AVFMT_GLOBALHEADER) {
    codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  }
  if (film.encoder == "libx264") {
    av_opt_set(codec->priv_data, "crf", "15", 0);
    av_opt_set(codec->priv_data, "x264-params", "scenecut=0:b-adapt=0", 0);
  } else {
    codec->flags |= AV_CODEC_FLAG_QSCALE;
    codec->global_quality = 2 * FF_QP2LAMBDA;
  }
  Require(avcodec_open2(codec, encoder, nullptr) == 0, "the encoder does not open");
  Require(avcodec_parameters_from_context(output.stream->codecpar, codec) >= 0, "parameters");
  output.Begin(codec->time_base);
  std::vector<Coded> coded;
  for (int i = 0; i < film.frames; ++i) {
    AVFrame* frame = av_frame_alloc();
    frame->format = codec->pix_fmt;
    frame->width = kWidth;
    frame->height = kHeight;
    frame->quality = codec->global_quality;
    Require(av_frame_get_buffer(frame, 0) >= 0, "no memory");
    frame->pts = i;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        frame->data[0][y * frame->linesize[0] + x] =
            static_cast<uint8_t>(Luma(i, x, y, film.is_flat));
      }
    }
    for (const int plane : {1, 2}) {
      std::fill_n(frame->data[plane],
                  static_cast<ptrdiff_t>(frame->linesize[plane]) * kHeight / 2,
                  uint8_t{128});
    }
    Require(avcodec_send_frame(codec, frame) == 0, "a frame is refused");
    Receive(codec, &coded);
    av_frame_free(&frame);
  }
  avcodec_send_frame(codec, nullptr);
  Receive(codec, &coded);
  if (film.is_packed) Pack(&coded);
  for (const Coded& picture : coded) Write(picture, 1, codec->time_base, &output);
  avcodec_free_context(&codec);
  output.Finish();
  return true;
}

void WriteFieldFilm(const std::filesystem::path& file, int frames, bool one_packet) {
  constexpr AVRational kFields = {1, 50};
  constexpr int kGroup = 12;
  Output output(file);
  output.stream->codecpar->codec_type = AVMEDIA_TYPE_VIDEO;
  output.stream->codecpar->codec_id = AV_CODEC_ID_H264;
  output.stream->codecpar->width = kWidth;
  output.stream->codecpar->height = kHeight;
  output.Begin(kFields);
  const std::string delimiter("\0\0\0\1\x09\xf0", 6);
  for (int i = 0; i < frames; ++i) {
    const int place = i % kGroup;
    const bool is_key = place == 0;
    const std::string top =
        delimiter + (is_key ? Parameters() : "") + Field(i, place, /*is_bottom=*/false);
    const std::string bottom = Field(i, place, /*is_bottom=*/true);
    const int flags = is_key ? AV_PKT_FLAG_KEY : 0;
    if (one_packet) {
      Write({top + bottom, 2 * i, 2 * i, flags}, 2, kFields, &output);
    } else {
      Write({top, 2 * i, 2 * i, flags}, 1, kFields, &output);
      Write({delimiter + bottom, 2 * i + 1, 2 * i + 1, 0}, 1, kFields, &output);
    }
  }
  output.Finish();
}

int NumberOf(const Image& frame) {
  int number = 0;
  for (int bit = 0; bit < kBits; ++bit) {
    double sum = 0.0;
    for (int y = 4; y < kBarHeight - 4; ++y) {
      for (int x = 3; x < kBarWidth - 3; ++x) sum += frame.At(1, y, bit * kBarWidth + x);
    }
    if (sum / ((kBarHeight - 8) * (kBarWidth - 6)) > 0.45) number |= 1 << bit;
  }
  return number;
}

std::vector<PacketPlace> PacketsOf(const std::filesystem::path& film) {
  AVFormatContext* container = nullptr;
  Require(avformat_open_input(&container, film.c_str(), nullptr, nullptr) == 0, "it does not open");
  AVPacket* packet = av_packet_alloc();
  std::vector<PacketPlace> places;
  while (av_read_frame(container, packet) >= 0) {
    places.push_back({packet->pos, packet->size});
    av_packet_unref(packet);
  }
  av_packet_free(&packet);
  avformat_close_input(&container);
  return places;
}

}  // namespace color3d
