#include "core/video/film_reader.h"

extern "C" {
#include <libavutil/display.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "core/base/error.h"
#include "core/video/libav.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr int kMaxSidePx = 8192;
// Times of frames that differ by less than this share of their mean distance are one rate.
constexpr double kRateTolerance = 0.2;

struct FreeConverter {
  void operator()(SwsContext* converter) const { sws_freeContext(converter); }
};

// A picture in a sound file, its cover, is no film.
AVStream* FindFilm(AVFormatContext* container) {
  for (unsigned i = 0; i < container->nb_streams; ++i) {
    AVStream* stream = container->streams[i];
    if (stream->codecpar->codec_type == AVMEDIA_TYPE_VIDEO &&
        (stream->disposition & AV_DISPOSITION_ATTACHED_PIC) == 0) {
      return stream;
    }
  }
  return nullptr;
}

int QuarterTurns(const AVStream& stream) {
  const uint8_t* matrix = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr);
  if (matrix == nullptr) return 0;
  // Anticlockwise, degrees; NaN for a matrix that is no rotation.
  const double turn = av_display_rotation_get(reinterpret_cast<const int32_t*>(matrix));
  if (!std::isfinite(turn)) return 0;
  return ((static_cast<int>(std::lround(-turn / 90.0)) % 4) + 4) % 4;
}

Image Turned(const Image& image, int quarter_turns) {
  if (quarter_turns == 0) return image;
  const bool lies = quarter_turns % 2 == 1;
  Image out(lies ? image.height : image.width, lies ? image.width : image.height, image.channels);
  for (int c = 0; c < out.channels; ++c) {
    for (int y = 0; y < out.height; ++y) {
      for (int x = 0; x < out.width; ++x) {
        int from_x = x, from_y = y;
        if (quarter_turns == 1) {
          from_x = y;
          from_y = image.height - 1 - x;
        } else if (quarter_turns == 2) {
          from_x = image.width - 1 - x;
          from_y = image.height - 1 - y;
        } else {
          from_x = image.width - 1 - y;
          from_y = x;
        }
        out.At(c, y, x) = image.At(c, from_y, from_x);
      }
    }
  }
  return out;
}

}  // namespace

class FilmReader::Impl {
 public:
  explicit Impl(fs::path file) : file_(std::move(file)) {
    av_log_set_level(AV_LOG_FATAL);
    Open();
    ScanTimes();
    OpenDecoder();
    TakeFacts();
  }

  const FilmFacts& facts() const { return facts_; }
  const std::vector<double>& times() const { return times_; }

  Image Read(int frame) {
    if (frame < 0 || frame >= static_cast<int>(times_.size())) {
      throw InvalidArgument("{} has no frame {}; it has 0 to {}", Name(), frame, times_.size() - 1);
    }
    if (!Decode(frame)) {
      throw Error(ErrorCode::kDataLoss,
                  "frame {} of {} (at {:.2f} s) is damaged and cannot be decoded",
                  frame,
                  Name(),
                  times_[frame]);
    }
    return Turned(Converted(), facts_.quarter_turns);
  }

 private:
  std::string Name() const { return file_.filename().string(); }

  [[noreturn]] void Refuse(const std::string& why) const {
    throw InvalidArgument("{} is no film that can be read: {}", Name(), why);
  }

  void Open() {
    if (!fs::is_regular_file(file_)) {
      throw Error(ErrorCode::kNotFound, "there is no film {}", file_.string());
    }
    AVFormatContext* container = nullptr;
    if (const int result = avformat_open_input(&container, file_.c_str(), nullptr, nullptr);
        result < 0) {
      Refuse(LibavError(result));
    }
    container_.reset(container);
    if (const int result = avformat_find_stream_info(container, nullptr); result < 0) {
      Refuse(LibavError(result));
    }
    stream_ = FindFilm(container);
    if (stream_ == nullptr) Refuse("it has no pictures, perhaps only sound");
    for (unsigned i = 0; i < container->nb_streams; ++i) {
      const AVStream* other = container->streams[i];
      facts_.has_sound |= other->codecpar->codec_type == AVMEDIA_TYPE_AUDIO;
      if (other != stream_) container->streams[i]->discard = AVDISCARD_ALL;
    }
  }

  // Stamps of all packets, in the order in which their pictures are shown.
  void ScanTimes() {
    const std::unique_ptr<AVPacket, FreePacket> packet(av_packet_alloc());
    std::map<int64_t, bool> shown;  // by stamp: does decoding begin here?
    int64_t last_duration = 0, without_stamp = 0;
    while (av_read_frame(container_.get(), packet.get()) >= 0) {
      // What an edit list cuts off is decoded for what follows it, and never shown.
      const bool is_shown = (packet->flags & AV_PKT_FLAG_DISCARD) == 0;
      if (packet->stream_index == stream_->index && packet->size > 0 && is_shown) {
        int64_t stamp = packet->pts;
        if (stamp == AV_NOPTS_VALUE) stamp = packet->dts;
        if (stamp == AV_NOPTS_VALUE) {
          ++without_stamp;
        } else {
          shown[stamp] |= (packet->flags & AV_PKT_FLAG_KEY) != 0;
          if (packet->duration > 0) last_duration = packet->duration;
        }
      }
      av_packet_unref(packet.get());
    }
    if (shown.empty()) {
      Refuse(without_stamp > 0 ? "its frames have no times; put it into a container, e.g. .mp4"
                               : "it holds no frame");
    }
    const double tick = av_q2d(stream_->time_base);
    for (const auto& [stamp, is_start] : shown) {
      stamps_.push_back(stamp);
      is_start_.push_back(is_start);
      times_.push_back(static_cast<double>(stamp - stamps_.front()) * tick);
    }
    facts_.first_s = static_cast<double>(stamps_.front()) * tick;
    facts_.seconds = times_.back() + static_cast<double>(last_duration) * tick;
    const double mean = times_.back() / std::max<size_t>(1, times_.size() - 1);
    for (size_t i = 1; i < times_.size(); ++i) {
      if (std::abs(times_[i] - times_[i - 1] - mean) > kRateTolerance * mean) {
        facts_.constant_rate = false;
      }
    }
  }

  void OpenDecoder() {
    const AVCodec* decoder = avcodec_find_decoder(stream_->codecpar->codec_id);
    if (decoder == nullptr) {
      Refuse(std::string("FFmpeg's libraries here have no decoder for ") +
             avcodec_get_name(stream_->codecpar->codec_id));
    }
    facts_.codec = decoder->name;
    codec_.reset(avcodec_alloc_context3(decoder));
    if (!codec_ || avcodec_parameters_to_context(codec_.get(), stream_->codecpar) < 0 ||
        avcodec_open2(codec_.get(), decoder, nullptr) < 0) {
      Refuse("its decoder " + facts_.codec + " does not open");
    }
    codec_->pkt_timebase = stream_->time_base;
    frame_.reset(av_frame_alloc());
    packet_.reset(av_packet_alloc());
  }

  void TakeFacts() {
    facts_.quarter_turns = QuarterTurns(*stream_);
    const AVRational aspect =
        av_guess_sample_aspect_ratio(container_.get(), stream_, /*frame=*/nullptr);
    const double stretch = aspect.num > 0 && aspect.den > 0 ? av_q2d(aspect) : 1.0;
    width_ = static_cast<int>(std::lround(codec_->width * stretch));
    height_ = codec_->height;
    if (width_ < 1 || height_ < 1 || width_ > kMaxSidePx || height_ > kMaxSidePx) {
      Refuse(fmt::format(
          "its frames are {} x {} px; up to {} px are taken", width_, height_, kMaxSidePx));
    }
    facts_.width = facts_.quarter_turns % 2 == 1 ? height_ : width_;
    facts_.height = facts_.quarter_turns % 2 == 1 ? width_ : height_;
    // A first frame that is damaged says nothing.
    facts_.interlaced = Decode(0) && frame_->interlaced_frame != 0;
  }

  // The stamp of the picture that the decoder hands out next; false at the end of the film.
  bool Advance() {
    while (true) {
      const int result = avcodec_receive_frame(codec_.get(), frame_.get());
      if (result == 0) return true;
      if (result == AVERROR_EOF) return false;
      bool fed = false;
      while (!fed && av_read_frame(container_.get(), packet_.get()) >= 0) {
        if (packet_->stream_index == stream_->index) {
          // What the decoder refuses is damaged: its picture will be missed below.
          avcodec_send_packet(codec_.get(), packet_.get());
          fed = true;
        }
        av_packet_unref(packet_.get());
      }
      if (!fed && avcodec_send_packet(codec_.get(), nullptr) < 0) return false;
    }
  }

  void Seek(int64_t stamp) {
    av_seek_frame(container_.get(), stream_->index, stamp, AVSEEK_FLAG_BACKWARD);
    avcodec_flush_buffers(codec_.get());
    at_ = -1;
  }

  // Decodes up to `frame`; false when it does not come out whole.
  bool Decode(int frame) {
    int start = frame;
    while (start > 0 && !is_start_[start]) --start;
    const bool goes_on = at_ >= 0 && at_ < frame && at_ >= start - 1;
    if (at_ == frame) return whole_;
    if (!goes_on) Seek(stamps_[start]);
    while (Advance()) {
      const int64_t stamp = frame_->best_effort_timestamp;
      const auto found = std::lower_bound(stamps_.begin(), stamps_.end(), stamp);
      at_ = static_cast<int>(found - stamps_.begin());
      if (stamp < stamps_[frame]) continue;
      whole_ = frame_->decode_error_flags == 0 && (frame_->flags & AV_FRAME_FLAG_CORRUPT) == 0;
      // A later picture that comes out in its place stays for its own turn.
      return stamp == stamps_[frame] && whole_;
    }
    at_ = -1;
    return false;
  }

  Image Converted() {
    // Of interlaced film the lines of one moment count: every second.
    const int step = frame_->interlaced_frame != 0 ? 2 : 1;
    const int lines = frame_->height / step;
    const uint8_t* data[4];
    int strides[4];
    for (int i = 0; i < 4; ++i) {
      data[i] = frame_->data[i];
      strides[i] = step * frame_->linesize[i];
    }
    converter_.reset(sws_getCachedContext(converter_.release(),
                                          frame_->width,
                                          lines,
                                          static_cast<AVPixelFormat>(frame_->format),
                                          width_,
                                          height_,
                                          AV_PIX_FMT_RGB48,
                                          SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT,
                                          nullptr,
                                          nullptr,
                                          nullptr));
    if (!converter_) {
      throw Error(ErrorCode::kDataLoss, "the pixels of {} cannot be converted", Name());
    }
    const int* matrix =
        sws_getCoefficients(frame_->colorspace == AVCOL_SPC_BT709        ? SWS_CS_ITU709
                            : frame_->colorspace == AVCOL_SPC_BT2020_NCL ? SWS_CS_BT2020
                                                                         : SWS_CS_ITU601);
    sws_setColorspaceDetails(converter_.get(),
                             matrix,
                             frame_->color_range == AVCOL_RANGE_JPEG,
                             sws_getCoefficients(SWS_CS_DEFAULT),
                             1,
                             0,
                             1 << 16,
                             1 << 16);
    rgb_.resize(static_cast<size_t>(width_) * height_ * 3);
    uint8_t* rows[] = {reinterpret_cast<uint8_t*>(rgb_.data())};
    const int row_bytes[] = {6 * width_};
    sws_scale(converter_.get(), data, strides, 0, lines, rows, row_bytes);
    Image image(width_, height_, 3);
    for (size_t i = 0; i < image.PlaneSize(); ++i) {
      for (int c = 0; c < 3; ++c) image.Plane(c)[i] = rgb_[3 * i + c] / 65535.0f;
    }
    return image;
  }

  const fs::path file_;
  std::unique_ptr<AVFormatContext, CloseFilm> container_;
  AVStream* stream_ = nullptr;
  std::unique_ptr<AVCodecContext, FreeCodec> codec_;
  std::unique_ptr<AVFrame, FreeFrame> frame_;
  std::unique_ptr<AVPacket, FreePacket> packet_;
  std::unique_ptr<SwsContext, FreeConverter> converter_;
  FilmFacts facts_;
  std::vector<int64_t> stamps_;  // of the frames, in the stream's time base
  std::vector<bool> is_start_;   // decoding can begin here
  std::vector<double> times_;
  int width_ = 0, height_ = 0;  // of square pixels, before turning
  int at_ = -1;                 // frame that was decoded last; -1: none
  bool whole_ = false;          // and whether it is undamaged
  std::vector<uint16_t> rgb_;
};

FilmReader::FilmReader(fs::path file) : impl_(std::make_unique<Impl>(std::move(file))) {}
FilmReader::~FilmReader() = default;
FilmReader::FilmReader(FilmReader&&) noexcept = default;
FilmReader& FilmReader::operator=(FilmReader&&) noexcept = default;
const FilmFacts& FilmReader::facts() const { return impl_->facts(); }
const std::vector<double>& FilmReader::times() const { return impl_->times(); }
Image FilmReader::Read(int frame) { return impl_->Read(frame); }

}  // namespace color3d
