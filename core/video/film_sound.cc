#include "core/video/film_sound.h"

#include <fmt/format.h>

extern "C" {
#include <libavutil/channel_layout.h>
}

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/video/film_file.h"
#include "core/video/sound_stream.h"

namespace color3d {
namespace {

// Codecs that MP4 players support.
constexpr AVCodecID kCopied[] = {
    AV_CODEC_ID_AAC, AV_CODEC_ID_MP3, AV_CODEC_ID_AC3, AV_CODEC_ID_EAC3, AV_CODEC_ID_OPUS};
constexpr int64_t kBitsPerChannel = 96000;
constexpr double kGapS = 0.02;  // times that differ by less are rounded, not gaps

}  // namespace

class FilmSound::Impl {
 public:
  Impl(const SoundPart& part, const CancellationToken* cancel) : part_(part) {
    try {
      file_ = std::make_unique<FilmFile>(part.film, cancel);
    } catch (const Error& e) {
      if (e.code() == ErrorCode::kCancelled) throw;
      return;
    }
    stream_ = MainSound(file_->container());
    if (stream_ == nullptr) return;
    file_->ReadOnly(stream_);
    packet_.reset(av_packet_alloc());
    const AVCodecID codec = stream_->codecpar->codec_id;
    if (std::find(std::begin(kCopied), std::end(kCopied), codec) != std::end(kCopied)) {
      parameters_ = stream_->codecpar;
      time_base_ = stream_->time_base;
    } else if (!OpenTranscoder()) {
      warning_ = fmt::format(
          "the film's sound ({}) is left out: MP4 does not hold it, and FFmpeg's libraries here "
          "cannot make AAC of it; add it by a program for films",
          avcodec_get_name(codec));
      return;
    }
    SeekTo(part.begin_s);
  }

  ~Impl() { avcodec_parameters_free(&coded_as_); }

  const AVCodecParameters* parameters() const { return parameters_; }
  AVRational time_base() const { return time_base_; }
  const std::string& warning() const { return warning_; }

  bool Next(AVPacket* packet) {
    if (parameters_ == nullptr) return false;
    return encoder_ ? NextCoded(packet) : NextCopied(packet);
  }

 private:
  double Tick() const { return av_q2d(stream_->time_base); }

  // Includes a little before the part, as preroll for decoders.
  void SeekTo(double begin_s) {
    constexpr double kBeforeS = 1.0;
    const auto stamp = static_cast<int64_t>((begin_s - kBeforeS) / Tick());
    if (stream_->start_time != AV_NOPTS_VALUE && stamp <= stream_->start_time) return;
    av_seek_frame(file_->container(), stream_->index, stamp, AVSEEK_FLAG_BACKWARD);
  }

  // The next packet of the file with a time.
  bool ReadPacket() {
    while (file_->ReadPacket(packet_.get())) {
      if (packet_->stream_index == stream_->index && packet_->size > 0) {
        if (packet_->pts == AV_NOPTS_VALUE) packet_->pts = packet_->dts;
        if (packet_->pts != AV_NOPTS_VALUE) return true;
      }
      av_packet_unref(packet_.get());
    }
    return false;
  }

  bool NextCopied(AVPacket* packet) {
    const auto zero = static_cast<int64_t>(std::llround(part_.begin_s / Tick()));
    const auto end = static_cast<int64_t>(std::llround(part_.end_s / Tick()));
    while (ReadPacket()) {
      if (packet_->pts >= end) break;
      // A decoder's first packet is not output in full.
      if (packet_->pts + 2 * packet_->duration > zero &&
          (last_ == AV_NOPTS_VALUE || packet_->pts > last_)) {
        last_ = packet_->pts;
        av_packet_move_ref(packet, packet_.get());
        packet->pts -= zero;
        packet->dts = packet->pts;  // sound is shown in the order in which it is stored
        return true;
      }
      av_packet_unref(packet_.get());
    }
    av_packet_unref(packet_.get());
    return false;
  }

  bool OpenTranscoder() {
    const AVCodec* decoder = avcodec_find_decoder(stream_->codecpar->codec_id);
    const AVCodec* encoder = avcodec_find_encoder_by_name("aac");
    if (decoder == nullptr || encoder == nullptr) return false;
    decoder_.reset(avcodec_alloc_context3(decoder));
    if (!decoder_ || avcodec_parameters_to_context(decoder_.get(), stream_->codecpar) < 0 ||
        avcodec_open2(decoder_.get(), decoder, nullptr) < 0) {
      return false;
    }
    decoder_->pkt_timebase = stream_->time_base;
    encoder_.reset(avcodec_alloc_context3(encoder));
    if (!encoder_) return false;
    channels_ = decoder_->ch_layout.nb_channels;
    encoder_->sample_rate = decoder_->sample_rate;
    encoder_->sample_fmt = AV_SAMPLE_FMT_FLTP;
    if (decoder_->ch_layout.order == AV_CHANNEL_ORDER_UNSPEC) {
      av_channel_layout_default(&encoder_->ch_layout, channels_);
    } else {
      av_channel_layout_copy(&encoder_->ch_layout, &decoder_->ch_layout);
    }
    encoder_->bit_rate = kBitsPerChannel * channels_;
    encoder_->time_base = {1, std::max(1, decoder_->sample_rate)};
    encoder_->flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_BITEXACT;
    coded_as_ = avcodec_parameters_alloc();
    frame_.reset(av_frame_alloc());
    if (channels_ < 1 || coded_as_ == nullptr || !frame_ ||
        avcodec_open2(encoder_.get(), encoder, nullptr) < 0 ||
        avcodec_parameters_from_context(coded_as_, encoder_.get()) < 0) {
      encoder_.reset();
      return false;
    }
    parameters_ = coded_as_;
    time_base_ = encoder_->time_base;
    waiting_.resize(channels_);
    length_ = std::llround((part_.end_s - part_.begin_s) * encoder_->sample_rate);
    return true;
  }

  bool NextCoded(AVPacket* packet) {
    while (true) {
      const int result = avcodec_receive_packet(encoder_.get(), packet);
      if (result == 0) return true;
      if (result != AVERROR(EAGAIN)) return false;
      if (static_cast<int>(waiting_[0].size()) >= encoder_->frame_size || decoded_all_) {
        EncodeWaiting();
      } else {
        DecodeMore();
      }
    }
  }

  // Encodes a queued frame, the last one perhaps short; or the end.
  void EncodeWaiting() {
    const int samples = std::min<int>(encoder_->frame_size, static_cast<int>(waiting_[0].size()));
    if (samples == 0) {
      avcodec_send_frame(encoder_.get(), nullptr);
      return;
    }
    const std::unique_ptr<AVFrame, FreeFrame> frame(av_frame_alloc());
    frame->nb_samples = samples;
    frame->format = encoder_->sample_fmt;
    frame->sample_rate = encoder_->sample_rate;
    av_channel_layout_copy(&frame->ch_layout, &encoder_->ch_layout);
    frame->pts = encoded_;
    encoded_ += samples;
    if (av_frame_get_buffer(frame.get(), 0) < 0) {
      decoded_all_ = true;
      for (auto& channel : waiting_) channel.clear();
      return;
    }
    for (int c = 0; c < channels_; ++c) {
      std::copy_n(waiting_[c].begin(), samples, reinterpret_cast<float*>(frame->extended_data[c]));
      waiting_[c].erase(waiting_[c].begin(), waiting_[c].begin() + samples);
    }
    avcodec_send_frame(encoder_.get(), frame.get());
  }

  void DecodeMore() {
    if (has_frame_) return Append();
    const int result = avcodec_receive_frame(decoder_.get(), frame_.get());
    if (result == 0) {
      PlaceFrame();
    } else if (result == AVERROR(EAGAIN)) {
      const bool more = ReadPacket();
      // Packets that the decoder refuses are damaged and replaced by silence.
      avcodec_send_packet(decoder_.get(), more ? packet_.get() : nullptr);
      av_packet_unref(packet_.get());
    } else {
      decoded_all_ = true;
    }
  }

  // Index of the next decoded sample in the written sound.
  int64_t NextSample() const { return encoded_ + static_cast<int64_t>(waiting_[0].size()); }

  void PlaceFrame() {
    has_frame_ = frame_->ch_layout.nb_channels == channels_;
    begins_at_ = NextSample();
    if (frame_->best_effort_timestamp == AV_NOPTS_VALUE) return;
    const int rate = encoder_->sample_rate;
    const double time_s = static_cast<double>(frame_->best_effort_timestamp) * Tick();
    const int64_t at = std::llround((time_s - part_.begin_s) * rate);
    const bool follows =
        has_begun_ && std::abs(static_cast<double>(at - begins_at_)) < kGapS * rate;
    if (!follows) begins_at_ = at;
  }

  // The part of the frame within the range, at its time; preceded by silence for gaps.
  void Append() {
    constexpr int64_t kSilence = 1 << 16;
    int64_t next = NextSample();
    const int64_t silent = std::min(kSilence, std::min(begins_at_, length_) - next);
    if (silent > 0) {
      for (auto& channel : waiting_) channel.insert(channel.end(), silent, 0.0f);
      next += silent;
    }
    if (next >= length_) {
      decoded_all_ = true;
      return;
    }
    if (next < begins_at_) return;
    const int64_t end = std::min(length_ - begins_at_, int64_t{frame_->nb_samples});
    for (int64_t i = next - begins_at_; i < end; ++i) {
      has_begun_ = true;
      for (int c = 0; c < channels_; ++c) {
        waiting_[c].push_back(SampleOf(*frame_, c, channels_, static_cast<int>(i)));
      }
    }
    has_frame_ = false;
    av_frame_unref(frame_.get());
  }

  const SoundPart part_;
  std::unique_ptr<FilmFile> file_;  // none: it cannot be had
  AVStream* stream_ = nullptr;
  std::unique_ptr<AVPacket, FreePacket> packet_;
  const AVCodecParameters* parameters_ = nullptr;
  AVRational time_base_{1, 1};
  std::string warning_;
  int64_t last_ = AV_NOPTS_VALUE;  // time of the packet copied last
  // For re-encoding:
  std::unique_ptr<AVCodecContext, FreeCodec> decoder_, encoder_;
  std::unique_ptr<AVFrame, FreeFrame> frame_;
  AVCodecParameters* coded_as_ = nullptr;
  int channels_ = 0;
  std::vector<std::vector<float>> waiting_;  // samples by channel, decoded and not yet coded
  int64_t encoded_ = 0;                      // samples
  int64_t length_ = 0;                       // of the part, samples
  bool has_frame_ = false;                   // frame_ is decoded and not yet in waiting_
  int64_t begins_at_ = 0;                    // its first sample, from the part's beginning
  bool has_begun_ = false;
  bool decoded_all_ = false;
};

FilmSound::FilmSound(const SoundPart& part, const CancellationToken* cancel)
    : impl_(std::make_unique<Impl>(part, cancel)) {}
FilmSound::~FilmSound() = default;
const AVCodecParameters* FilmSound::parameters() const { return impl_->parameters(); }
AVRational FilmSound::time_base() const { return impl_->time_base(); }
const std::string& FilmSound::warning() const { return impl_->warning(); }
bool FilmSound::Next(AVPacket* packet) { return impl_->Next(packet); }

}  // namespace color3d
