#include "core/video/film_reader.h"

extern "C" {
#include <libavutil/display.h>
#include <libavutil/mastering_display_metadata.h>
#include <libavutil/pixdesc.h>
}

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/base/error.h"
#include "core/video/film_decoder.h"
#include "core/video/frame_converter.h"
#include "core/video/hdr_tones.h"
#include "core/video/libav.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Frame times whose intervals differ by less than this share of the mean have a constant rate.
constexpr double kRateTolerance = 0.2;
// Maximum number of first frames decoded to find an undamaged one, which gives the pictures'
// format.
constexpr int kFirstTries = 250;

int QuarterTurns(const AVStream& stream) {
  const uint8_t* matrix = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr);
  if (matrix == nullptr) return 0;
  // Anticlockwise, degrees; NaN if the matrix is no rotation.
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

FilmTransfer TransferOf(const AVFrame& frame) {
  if (frame.color_trc == AVCOL_TRC_SMPTE2084) return FilmTransfer::kPq;
  if (frame.color_trc == AVCOL_TRC_ARIB_STD_B67) return FilmTransfer::kHlg;
  return FilmTransfer::kUsual;
}

// Side data of the frame, else of its stream; null if there is none or it is smaller than `Facts`.
template <typename Facts>
const Facts* FindSideData(const AVFrame& frame,
                          AVFrameSideDataType of_frame,
                          const AVStream& stream,
                          AVPacketSideDataType of_stream) {
  if (const AVFrameSideData* data = av_frame_get_side_data(&frame, of_frame);
      data != nullptr && data->size >= sizeof(Facts)) {
    return reinterpret_cast<const Facts*>(data->data);
  }
  size_t size = 0;
  const uint8_t* data = av_stream_get_side_data(&stream, of_stream, &size);
  return data != nullptr && size >= sizeof(Facts) ? reinterpret_cast<const Facts*>(data) : nullptr;
}

// Peak luminance of a PQ film, cd/m2: as stated, else that of its mastering display.
double PeakNits(const AVFrame& frame, const AVStream& stream) {
  double peak = 0.0;
  if (const auto* light = FindSideData<AVContentLightMetadata>(
          frame, AV_FRAME_DATA_CONTENT_LIGHT_LEVEL, stream, AV_PKT_DATA_CONTENT_LIGHT_LEVEL)) {
    peak = light->MaxCLL;
  }
  const auto* display =
      FindSideData<AVMasteringDisplayMetadata>(frame,
                                               AV_FRAME_DATA_MASTERING_DISPLAY_METADATA,
                                               stream,
                                               AV_PKT_DATA_MASTERING_DISPLAY_METADATA);
  if (peak <= 0.0 && display != nullptr && display->has_luminance != 0 &&
      display->max_luminance.den != 0) {
    peak = av_q2d(display->max_luminance);
  }
  return peak > 0.0 ? std::clamp(peak, kHdrWhiteNits, 10000.0) : kUsualPeakNits;
}

}  // namespace

class FilmReader::Impl {
 public:
  Impl(const fs::path& file, const CancellationToken* cancel) : file_(file), film_(file, cancel) {
    ReadTimes();
    ReadFacts();
    ReadFirstFrame();
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

  void ReadTimes() {
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

  void ReadFacts() {
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
    if (width_ < 1 || height_ < 1 || width_ > kMaxFilmSidePx || height_ > kMaxFilmSidePx) {
      RefuseFilm(
          file_,
          fmt::format(
              "its frames are {} x {} px; up to {} px are taken", width_, height_, kMaxFilmSidePx));
    }
    facts_.width = facts_.quarter_turns % 2 == 1 ? height_ : width_;
    facts_.height = facts_.quarter_turns % 2 == 1 ? width_ : height_;
    const int streams = film_.packets().stream_count();
    if (streams < 2) return;
    const AVStream& stream = *film_.packets().stream();
    facts_.notes.push_back(fmt::format(
        "has {} streams of pictures; the one of {} x {} px (stream {}) is taken: it is {}",
        streams,
        film_.codec().width,
        film_.codec().height,
        stream.index,
        (stream.disposition & AV_DISPOSITION_DEFAULT) != 0 ? "marked as the default"
                                                           : "the largest"));
  }

  // Facts known only from decoded frames. Damaged frames are skipped; recordings begin with some.
  void ReadFirstFrame() {
    const int tries = std::min(kFirstTries, static_cast<int>(times_.size()));
    int frame = 0;
    while (frame < tries && !film_.Decode(frame)) ++frame;
    if (frame == tries) return;
    const AVFrame& picture = film_.picture();
    if (const auto format = static_cast<AVPixelFormat>(picture.format); !CanConvert(format)) {
      const char* name = av_get_pix_fmt_name(format);
      RefuseFilm(file_,
                 fmt::format("its pixels ({}) cannot be converted; save it in another format, e.g. "
                             "`ffmpeg -i {} -c:v ffv1 film.mkv`",
                             name != nullptr ? name : "unknown",
                             Name()));
    }
    facts_.interlaced = picture.interlaced_frame != 0;
    ReadTones(picture);
  }

  void ReadTones(const AVFrame& picture) {
    const FilmTransfer transfer = TransferOf(picture);
    const bool is_wide = picture.color_primaries == AVCOL_PRI_BT2020;
    if (transfer == FilmTransfer::kUsual && !is_wide) return;
    const double peak_nits = transfer == FilmTransfer::kPq
                                 ? PeakNits(picture, *film_.packets().stream())
                                 : kUsualPeakNits;
    tones_.emplace(transfer, is_wide, peak_nits);
    if (transfer == FilmTransfer::kUsual) return;
    facts_.hdr = transfer == FilmTransfer::kPq ? "PQ" : "HLG";
    facts_.peak_nits = peak_nits;
    facts_.notes.push_back(
        fmt::format("is HDR ({}): its tones are mapped to the usual range, up to {:.0f} cd/m2 that "
                    "become white (BT.2390); for another look give a film that is graded for it",
                    facts_.hdr,
                    peak_nits));
  }

  // Some decoders report limited range for grey if the file states none (MagicYUV, HEVC, AV1),
  // which is rarely intended: the container is trusted, and H.264, whose decoder reports only
  // stated values.
  AVColorRange RangeOf(const AVFrame& picture) const {
    const bool is_stated = film_.packets().stated_range() == AVCOL_RANGE_MPEG ||
                           film_.codec().codec_id == AV_CODEC_ID_H264;
    return picture.color_range == AVCOL_RANGE_MPEG && !is_stated &&
                   IsGray(static_cast<AVPixelFormat>(picture.format))
               ? AVCOL_RANGE_UNSPECIFIED
               : picture.color_range;
  }

  Image Converted() {
    const AVFrame& picture = film_.picture();
    Image image = converter_.Convert(picture, RangeOf(picture), width_, height_);
    if (tones_) tones_->Apply(&image);
    return image;
  }

  const fs::path file_;
  FilmDecoder film_;
  FrameConverter converter_;
  std::optional<HdrTones> tones_;  // none: they stay
  FilmFacts facts_;
  std::vector<double> times_;
  int width_ = 0, height_ = 0;  // of square pixels, before rotation
};

FilmReader::FilmReader(fs::path file, const CancellationToken* cancel)
    : impl_(std::make_unique<Impl>(file, cancel)) {}
FilmReader::~FilmReader() = default;
FilmReader::FilmReader(FilmReader&&) noexcept = default;
FilmReader& FilmReader::operator=(FilmReader&&) noexcept = default;
const FilmFacts& FilmReader::facts() const { return impl_->facts(); }
const std::vector<double>& FilmReader::times() const { return impl_->times(); }
Image FilmReader::Read(int frame) { return impl_->Read(frame); }

}  // namespace color3d
