#include "core/video/mp4_writer.h"

extern "C" {
#include <libavutil/opt.h>
}

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/range_check.h"
#include "core/video/film_sound.h"
#include "core/video/libav.h"
#include "core/video/yuv.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Best first. Other encoders of FFmpeg need a graphics card or are proprietary.
constexpr const char* kEncoders[] = {"libx264", "libopenh264", "mpeg4"};
constexpr int kKeyFrameSeconds = 2;  // a player that is moved has this much to decode at most

struct CloseMovie {
  void operator()(AVFormatContext* movie) const {
    if (movie->pb != nullptr) avio_closep(&movie->pb);
    avformat_free_context(movie);
  }
};

// `result`: return value of FFmpeg, < 0.
[[noreturn]] void Fail(const fs::path& path, const char* what, int result) {
  const std::string words = LibavError(result);
  if (result == AVERROR(ENOSPC) || result == AVERROR(EDQUOT) || result == AVERROR(EFBIG)) {
    throw Error(ErrorCode::kResourceExhausted,
                "cannot write {}: {}; free some disk space",
                path.filename().string(),
                words);
  }
  throw Error(
      result == AVERROR(ENOMEM) ? ErrorCode::kResourceExhausted : ErrorCode::kFailedPrecondition,
      "cannot {} {}: {}",
      what,
      path.filename().string(),
      words);
}

std::string EncodersText() {
  std::string text;
  for (const char* name : kEncoders) text += (text.empty() ? "" : ", ") + std::string(name);
  return text;
}

}  // namespace

class Mp4Writer::Impl {
 public:
  Impl(fs::path path, const Mp4Options& options)
      : path_(std::move(path)), part_(path_.string() + ".part"), options_(options) {
    CheckOptions();
    av_log_set_level(AV_LOG_ERROR);
    OpenEncoder();
    if (options_.sound) sound_ = std::make_unique<FilmSound>(*options_.sound, options_.cancel);
    OpenMovie();
    frame_.reset(av_frame_alloc());
    packet_.reset(av_packet_alloc());
    sound_packet_.reset(av_packet_alloc());
    if (!frame_ || !packet_ || !sound_packet_) Fail(path_, "begin", AVERROR(ENOMEM));
    frame_->format = codec_->pix_fmt;
    frame_->width = options_.width;
    frame_->height = options_.height;
    Require(av_frame_get_buffer(frame_.get(), 0), "begin");
  }

  ~Impl() {
    movie_.reset();  // closes the file
    std::error_code none;
    fs::remove(part_, none);
  }

  const std::string& encoder() const { return encoder_; }
  const std::string& sound_warning() const { return sound_ ? sound_->warning() : nothing_; }

  void Add(const Image& srgb, ThreadPool& pool) {
    if (options_.ticks_per_second > 0) {
      throw InvalidArgument("pictures of this movie need a time; use AddAt");
    }
    AddTick(count_, 1, srgb, pool);
  }

  void AddAt(double time_s, double seconds, const Image& srgb, ThreadPool& pool) {
    const int64_t tick = std::llround(time_s * options_.ticks_per_second);
    if (options_.ticks_per_second == 0 || !(seconds > 0.0) || tick < 0 ||
        (count_ == 0 ? tick != 0 : tick <= last_tick_)) {
      throw InvalidArgument(
          "a picture at {} s for {} s cannot follow {} others in a movie of {} ticks per second",
          time_s,
          seconds,
          count_,
          options_.ticks_per_second);
    }
    AddTick(
        tick, std::max<int64_t>(1, std::llround(seconds * options_.ticks_per_second)), srgb, pool);
  }

  void Finish() {
    if (count_ == 0) throw InvalidArgument("a movie needs at least one picture");
    Encode(nullptr);
    WriteSound(std::numeric_limits<double>::infinity());
    Require(av_write_trailer(movie_.get()), "write the end of");
    const int closed = avio_closep(&movie_->pb);
    Require(closed, "write the end of");
    PublishFile(part_, path_);
  }

 private:
  void AddTick(int64_t tick, int64_t ticks, const Image& srgb, ThreadPool& pool) {
    if (srgb.width != options_.width || srgb.height != options_.height || srgb.channels != 3) {
      throw InvalidArgument(
          "a picture of {} x {} px and {} channels does not fit a colour movie of {} x "
          "{} px",
          srgb.width,
          srgb.height,
          srgb.channels,
          options_.width,
          options_.height);
    }
    // The encoder may still reference the last one.
    Require(av_frame_make_writable(frame_.get()), "go on with");
    YuvFromSrgb(srgb,
                {frame_->data[0], frame_->linesize[0]},
                {frame_->data[1], frame_->linesize[1]},
                {frame_->data[2], frame_->linesize[2]},
                pool);
    frame_->pts = last_tick_ = tick;
    ticks_of_[tick] = ticks;
    ++count_;
    Encode(frame_.get());
    WriteSound(static_cast<double>(tick) * av_q2d(codec_->time_base));
  }

  void Require(int result, const char* what) const {
    if (result < 0) Fail(path_, what, result);
  }

  void CheckOptions() const {
    const RangeCheck check("movie option");
    check("width", options_.width, kMinMovieSidePx, kMaxMovieSidePx);
    check("height", options_.height, kMinMovieSidePx, kMaxMovieSidePx);
    check("frames_per_second", options_.frames_per_second, 1, 120);
    check("ticks_per_second", options_.ticks_per_second, 0, 65535);
    if (options_.width % 2 != 0 || options_.height % 2 != 0) {
      throw InvalidArgument(
          "the sides of a movie must be even, not {} x {} px", options_.width, options_.height);
    }
  }

  void OpenEncoder() {
    int failure = AVERROR_ENCODER_NOT_FOUND;
    for (const char* name : kEncoders) {
      const AVCodec* codec = avcodec_find_encoder_by_name(name);
      if (codec == nullptr) continue;
      failure = TryEncoder(*codec);
      if (failure >= 0) return;
    }
    char words[AV_ERROR_MAX_STRING_SIZE] = {};
    av_strerror(failure, words, sizeof words);
    throw Error(
        ErrorCode::kFailedPrecondition,
        "libavcodec of this machine cannot encode movies ({}): it has none of {}, or none works; "
        "install one with libx264 (Debian's libavcodec), or render pictures instead",
        words,
        EncodersText());
  }

  int TryEncoder(const AVCodec& codec) {
    codec_.reset(avcodec_alloc_context3(&codec));
    if (!codec_) return AVERROR(ENOMEM);
    const AVRational rate = av_d2q(options_.frames_per_second, 1001 * 1000);
    codec_->width = options_.width;
    codec_->height = options_.height;
    codec_->pix_fmt = AV_PIX_FMT_YUV420P;
    codec_->time_base =
        options_.ticks_per_second > 0 ? AVRational{1, options_.ticks_per_second} : av_inv_q(rate);
    codec_->framerate = rate;
    codec_->sample_aspect_ratio = {1, 1};
    codec_->gop_size =
        std::max(1, static_cast<int>(std::lround(kKeyFrameSeconds * options_.frames_per_second)));
    // With two threads, one movie of a thousand differed in bytes. A second one saves 10 ms a frame
    // of 854 x 480 px.
    codec_->thread_count = 1;
    codec_->color_range = AVCOL_RANGE_MPEG;
    codec_->color_primaries = AVCOL_PRI_BT709;
    codec_->color_trc = AVCOL_TRC_BT709;
    codec_->colorspace = AVCOL_SPC_BT709;
    codec_->chroma_sample_location = AVCHROMA_LOC_LEFT;
    codec_->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;  // MP4 has the headers apart
    const std::string name = codec.name;
    if (name == "libx264") {
      av_opt_set(codec_->priv_data, "preset", "medium", 0);
      av_opt_set(codec_->priv_data, "crf", "17", 0);
    } else if (name == "mpeg4") {
      codec_->flags |= AV_CODEC_FLAG_QSCALE;
      codec_->global_quality = 2 * FF_QP2LAMBDA;
    } else {
      // About as good for pictures of our size.
      codec_->bit_rate = static_cast<int64_t>(0.25 * options_.width * options_.height *
                                              options_.frames_per_second);
    }
    const int result = avcodec_open2(codec_.get(), &codec, nullptr);
    if (result >= 0) encoder_ = name;
    return result;
  }

  void OpenMovie() {
    AVFormatContext* movie = nullptr;
    Require(avformat_alloc_output_context2(&movie, nullptr, "mp4", part_.c_str()), "begin");
    movie_.reset(movie);
    stream_ = avformat_new_stream(movie, nullptr);
    if (stream_ == nullptr) Fail(path_, "begin", AVERROR(ENOMEM));
    Require(avcodec_parameters_from_context(stream_->codecpar, codec_.get()), "begin");
    stream_->time_base = codec_->time_base;
    stream_->avg_frame_rate = codec_->framerate;
    if (sound_ && sound_->parameters() != nullptr) {
      sound_stream_ = avformat_new_stream(movie, nullptr);
      if (sound_stream_ == nullptr) Fail(path_, "begin", AVERROR(ENOMEM));
      Require(avcodec_parameters_copy(sound_stream_->codecpar, sound_->parameters()), "begin");
      sound_stream_->codecpar->codec_tag = 0;  // this container's own
      sound_stream_->time_base = sound_->time_base();
    }
    movie->flags |= AVFMT_FLAG_BITEXACT;  // equal pictures, equal bytes
    Require(avio_open(&movie->pb, part_.c_str(), AVIO_FLAG_WRITE), "write");
    // The index comes first, so that browsers can start before the download ends.
    AVDictionary* options = nullptr;
    av_dict_set(&options, "movflags", "+faststart", 0);
    const int result = avformat_write_header(movie, &options);
    av_dict_free(&options);
    Require(result, "write");
  }

  void Encode(const AVFrame* frame) {
    Require(avcodec_send_frame(codec_.get(), frame), "encode");
    for (;;) {
      const int result = avcodec_receive_packet(codec_.get(), packet_.get());
      if (result == AVERROR(EAGAIN) || result == AVERROR_EOF) return;
      Require(result, "encode");
      const auto ticks = ticks_of_.find(packet_->pts);
      packet_->duration = ticks != ticks_of_.end() ? ticks->second : 1;
      if (ticks != ticks_of_.end()) ticks_of_.erase(ticks);
      av_packet_rescale_ts(packet_.get(), codec_->time_base, stream_->time_base);
      packet_->stream_index = stream_->index;
      Require(av_interleaved_write_frame(movie_.get(), packet_.get()), "write");
    }
  }

  // Writes all sound up to a time.
  void WriteSound(double until_s) {
    if (sound_stream_ == nullptr) return;
    while (heard_s_ <= until_s) {
      if (!sound_->Next(sound_packet_.get())) {
        heard_s_ = std::numeric_limits<double>::infinity();
        return;
      }
      const AVRational ticks = sound_->time_base();
      heard_s_ = static_cast<double>(sound_packet_->pts) * av_q2d(ticks);
      av_packet_rescale_ts(sound_packet_.get(), ticks, sound_stream_->time_base);
      sound_packet_->stream_index = sound_stream_->index;
      Require(av_interleaved_write_frame(movie_.get(), sound_packet_.get()), "write the sound of");
    }
  }

  const fs::path path_;
  const std::string part_;
  const Mp4Options options_;
  std::string encoder_;
  int64_t count_ = 0;
  int64_t last_tick_ = 0;
  std::map<int64_t, int64_t> ticks_of_;  // duration by time, of pictures in the encoder
  std::unique_ptr<AVCodecContext, FreeCodec> codec_;
  std::unique_ptr<AVFormatContext, CloseMovie> movie_;
  AVStream* stream_ = nullptr;  // the movie's
  std::unique_ptr<AVFrame, FreeFrame> frame_;
  std::unique_ptr<AVPacket, FreePacket> packet_, sound_packet_;
  const std::string nothing_;
  std::unique_ptr<FilmSound> sound_;
  AVStream* sound_stream_ = nullptr;  // the movie's; none where there is no sound
  double heard_s_ = -std::numeric_limits<double>::infinity();  // beginning of the last packet
};

Mp4Writer::Mp4Writer(fs::path path, const Mp4Options& options)
    : impl_(std::make_unique<Impl>(std::move(path), options)) {}
Mp4Writer::~Mp4Writer() = default;
const std::string& Mp4Writer::encoder() const { return impl_->encoder(); }
const std::string& Mp4Writer::sound_warning() const { return impl_->sound_warning(); }
void Mp4Writer::Add(const Image& srgb, ThreadPool& pool) { impl_->Add(srgb, pool); }
void Mp4Writer::AddAt(double time_s, double seconds, const Image& srgb, ThreadPool& pool) {
  impl_->AddAt(time_s, seconds, srgb, pool);
}
void Mp4Writer::Finish() { impl_->Finish(); }

}  // namespace color3d
