#include "core/video/film_reader.h"

extern "C" {
#include <libavutil/display.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/base/error.h"
#include "core/video/film_decoder.h"
#include "core/video/libav.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr int kMaxSidePx = 8192;
// Times of frames that differ by less than this share of their mean distance are one rate.
constexpr double kRateTolerance = 0.2;
// First frames that are asked whether the film is interlaced, until one is whole.
constexpr int kInterlaceTries = 250;

struct FreeConverter {
  void operator()(SwsContext* converter) const { sws_freeContext(converter); }
};

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
  explicit Impl(const fs::path& file) : file_(file), film_(file) {
    TakeTimes();
    TakeFacts();
  }

  const FilmFacts& facts() const { return facts_; }
  const std::vector<double>& times() const { return times_; }

  Image Read(int frame) {
    if (frame < 0 || frame >= static_cast<int>(times_.size())) {
      throw InvalidArgument("{} has no frame {}; it has 0 to {}", Name(), frame, times_.size() - 1);
    }
    if (!film_.Decode(frame)) {
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

  void TakeTimes() {
    const std::vector<int64_t>& stamps = film_.index().stamps;
    const double tick = av_q2d(film_.packets().stream()->time_base);
    for (const int64_t stamp : stamps) {
      times_.push_back(static_cast<double>(stamp - stamps.front()) * tick);
    }
    facts_.first_s = static_cast<double>(stamps.front()) * tick;
    facts_.seconds = times_.back() + static_cast<double>(film_.index().last_duration) * tick;
    const double mean = times_.back() / std::max<size_t>(1, times_.size() - 1);
    for (size_t i = 1; i < times_.size(); ++i) {
      if (std::abs(times_[i] - times_[i - 1] - mean) > kRateTolerance * mean) {
        facts_.constant_rate = false;
      }
    }
  }

  void TakeFacts() {
    AVFormatContext* container = film_.packets().container();
    for (unsigned i = 0; i < container->nb_streams; ++i) {
      facts_.has_sound |= container->streams[i]->codecpar->codec_type == AVMEDIA_TYPE_AUDIO;
    }
    facts_.codec = film_.codec().codec->name;
    facts_.quarter_turns = QuarterTurns(*film_.packets().stream());
    const AVRational aspect =
        av_guess_sample_aspect_ratio(container, film_.packets().stream(), /*frame=*/nullptr);
    const double stretch = aspect.num > 0 && aspect.den > 0 ? av_q2d(aspect) : 1.0;
    width_ = static_cast<int>(std::lround(film_.codec().width * stretch));
    height_ = film_.codec().height;
    if (width_ < 1 || height_ < 1 || width_ > kMaxSidePx || height_ > kMaxSidePx) {
      RefuseFilm(
          file_,
          fmt::format(
              "its frames are {} x {} px; up to {} px are taken", width_, height_, kMaxSidePx));
    }
    facts_.width = facts_.quarter_turns % 2 == 1 ? height_ : width_;
    facts_.height = facts_.quarter_turns % 2 == 1 ? width_ : height_;
    // A frame that is damaged says nothing; recordings begin with some.
    const int tries = std::min(kInterlaceTries, static_cast<int>(times_.size()));
    for (int frame = 0; frame < tries; ++frame) {
      if (!film_.Decode(frame)) continue;
      facts_.interlaced = film_.picture().interlaced_frame != 0;
      break;
    }
  }

  Image Converted() {
    const AVFrame& frame = film_.picture();
    // Of interlaced film the lines of one moment count: every second.
    const int step = frame.interlaced_frame != 0 ? 2 : 1;
    const int lines = frame.height / step;
    const uint8_t* data[4];
    int strides[4];
    for (int i = 0; i < 4; ++i) {
      data[i] = frame.data[i];
      strides[i] = step * frame.linesize[i];
    }
    converter_.reset(sws_getCachedContext(converter_.release(),
                                          frame.width,
                                          lines,
                                          static_cast<AVPixelFormat>(frame.format),
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
        sws_getCoefficients(frame.colorspace == AVCOL_SPC_BT709        ? SWS_CS_ITU709
                            : frame.colorspace == AVCOL_SPC_BT2020_NCL ? SWS_CS_BT2020
                                                                       : SWS_CS_ITU601);
    sws_setColorspaceDetails(converter_.get(),
                             matrix,
                             frame.color_range == AVCOL_RANGE_JPEG,
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
  FilmDecoder film_;
  std::unique_ptr<SwsContext, FreeConverter> converter_;
  FilmFacts facts_;
  std::vector<double> times_;
  int width_ = 0, height_ = 0;  // of square pixels, before turning
  std::vector<uint16_t> rgb_;
};

FilmReader::FilmReader(fs::path file) : impl_(std::make_unique<Impl>(file)) {}
FilmReader::~FilmReader() = default;
FilmReader::FilmReader(FilmReader&&) noexcept = default;
FilmReader& FilmReader::operator=(FilmReader&&) noexcept = default;
const FilmFacts& FilmReader::facts() const { return impl_->facts(); }
const std::vector<double>& FilmReader::times() const { return impl_->times(); }
Image FilmReader::Read(int frame) { return impl_->Read(frame); }

}  // namespace color3d
