#include "core/video/sound_offset.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>

#include "core/base/error.h"
#include "core/video/film_file.h"
#include "core/video/libav.h"
#include "core/video/sound_stream.h"

namespace color3d {
namespace {

constexpr float kSilence = -8.0f;
constexpr int kTrend = 20;  // levels on either side; slower changes are of the room and the gain
// Adjacent levels are correlated: this number of them counts as one observation.
constexpr double kLevelsPerSample = 5.0;
constexpr double kLeastOverlapS = 2.0;
// Minimum correlation in standard deviations of unrelated sounds: one lag of many must be
// clearly better.
constexpr double kLeastScore = 7.0;
constexpr double kLeastLead = 1.4;  // over the best lag elsewhere
constexpr int kPeakReach = 25;      // levels about the best lag that are still its peak

// Decoded sound, frame by frame.
class SoundDecoder {
 public:
  // Throws Error as FilmFile does.
  SoundDecoder(const SoundPart& part, const CancellationToken& cancel) : file_(part.film, &cancel) {
    stream_ = MainSound(file_.container());
    file_.ReadOnly(stream_);
    const AVCodec* codec =
        stream_ == nullptr ? nullptr : avcodec_find_decoder(stream_->codecpar->codec_id);
    if (codec == nullptr) return;
    decoder_.reset(avcodec_alloc_context3(codec));
    packet_.reset(av_packet_alloc());
    frame_.reset(av_frame_alloc());
    is_open_ = decoder_ && packet_ && frame_ &&
               avcodec_parameters_to_context(decoder_.get(), stream_->codecpar) >= 0 &&
               avcodec_open2(decoder_.get(), codec, nullptr) >= 0;
    if (is_open_) decoder_->pkt_timebase = stream_->time_base;
  }

  // Null after the last one.
  const AVFrame* Next() {
    while (is_open_) {
      const int result = avcodec_receive_frame(decoder_.get(), frame_.get());
      if (result == 0) return frame_.get();
      if (result != AVERROR(EAGAIN)) break;
      const bool more = ReadPacket();
      avcodec_send_packet(decoder_.get(), more ? packet_.get() : nullptr);
      av_packet_unref(packet_.get());
    }
    return nullptr;
  }

  // Time of the last frame in the file, s.
  double TimeOf(const AVFrame& frame) const {
    return static_cast<double>(frame.best_effort_timestamp) * av_q2d(stream_->time_base);
  }

 private:
  bool ReadPacket() {
    while (file_.ReadPacket(packet_.get())) {
      if (packet_->stream_index == stream_->index) return true;
      av_packet_unref(packet_.get());
    }
    return false;
  }

  FilmFile file_;
  AVStream* stream_ = nullptr;
  std::unique_ptr<AVCodecContext, FreeCodec> decoder_;
  std::unique_ptr<AVPacket, FreePacket> packet_;
  std::unique_ptr<AVFrame, FreeFrame> frame_;
  bool is_open_ = false;
};

// None if the file cannot be read.
std::unique_ptr<SoundDecoder> OpenSound(const SoundPart& part, const CancellationToken& cancel) {
  try {
    return std::make_unique<SoundDecoder>(part, cancel);
  } catch (const Error& e) {
    if (e.code() == ErrorCode::kCancelled) throw;
    return nullptr;
  }
}

// Levels minus their moving average.
std::vector<double> WithoutTrend(const std::vector<float>& levels) {
  const auto count = static_cast<int>(levels.size());
  std::vector<double> sum(count + 1, 0.0), change(count);
  for (int i = 0; i < count; ++i) sum[i + 1] = sum[i] + levels[i];
  for (int i = 0; i < count; ++i) {
    const int begin = std::max(0, i - kTrend), end = std::min(count, i + kTrend + 1);
    change[i] = levels[i] - (sum[end] - sum[begin]) / (end - begin);
  }
  return change;
}

std::vector<double> SumsOfSquares(const std::vector<double>& values) {
  std::vector<double> sums(values.size() + 1, 0.0);
  for (size_t i = 0; i < values.size(); ++i) sums[i + 1] = sums[i] + values[i] * values[i];
  return sums;
}

// Entry `lag` modulo its size: the sum over i of one[i + lag] * other[i].
std::vector<double> CrossSums(const std::vector<double>& one, const std::vector<double>& other) {
  const int size = cv::getOptimalDFTSize(static_cast<int>(one.size() + other.size()));
  const auto spectrum_of = [&](const std::vector<double>& values) {
    cv::Mat padded = cv::Mat::zeros(1, size, CV_64F), spectrum;
    std::copy(values.begin(), values.end(), padded.ptr<double>());
    cv::dft(padded, spectrum);
    return spectrum;
  };
  cv::Mat product, sums;
  cv::mulSpectrums(spectrum_of(one), spectrum_of(other), product, 0, /*conjB=*/true);
  cv::idft(product, sums, cv::DFT_SCALE);
  return {sums.ptr<double>(), sums.ptr<double>() + size};
}

}  // namespace

std::vector<float> SoundLevels(const SoundPart& part, const CancellationToken& cancel) {
  const auto count =
      static_cast<int64_t>(std::ceil((part.end_s - part.begin_s) * kSoundLevelsPerSecond));
  if (count < 1) return {};
  std::vector<double> squares(count, 0.0), samples(count, 0.0);
  const std::unique_ptr<SoundDecoder> decoder = OpenSound(part, cancel);
  if (!decoder) return {};
  while (const AVFrame* frame = decoder->Next()) {
    cancel.ThrowIfCancelled();
    if (frame->best_effort_timestamp == AV_NOPTS_VALUE || frame->sample_rate < 1) continue;
    const double begin_s = decoder->TimeOf(*frame) - part.begin_s;
    if (begin_s * kSoundLevelsPerSecond >= static_cast<double>(count)) break;
    const int channels = frame->ch_layout.nb_channels;
    for (int i = 0; i < frame->nb_samples; ++i) {
      const double at = (begin_s + i / static_cast<double>(frame->sample_rate));
      const auto level = static_cast<int64_t>(std::floor(at * kSoundLevelsPerSecond));
      if (level < 0 || level >= count) continue;
      for (int c = 0; c < channels; ++c) {
        const float sample = SampleOf(*frame, c, channels, i);
        squares[level] += sample * sample;
      }
      samples[level] += channels;
    }
  }
  if (std::all_of(samples.begin(), samples.end(), [](double n) { return n == 0.0; })) return {};
  std::vector<float> levels(count, kSilence);
  for (int64_t i = 0; i < count; ++i) {
    if (samples[i] == 0.0 || !std::isfinite(squares[i])) continue;
    levels[i] = std::max(kSilence, static_cast<float>(std::log10(squares[i] / samples[i] + 1e-12)));
  }
  return levels;
}

std::optional<double> SoundOffset(const std::vector<float>& one, const std::vector<float>& other) {
  const auto least = static_cast<int64_t>(kLeastOverlapS * kSoundLevelsPerSecond);
  const auto n = static_cast<int64_t>(one.size()), m = static_cast<int64_t>(other.size());
  if (std::min(n, m) < least) return std::nullopt;
  const std::vector<double> a = WithoutTrend(one), b = WithoutTrend(other);
  const std::vector<double> sum_a = SumsOfSquares(a), sum_b = SumsOfSquares(b);
  const std::vector<double> sums = CrossSums(a, b);
  const auto size = static_cast<int64_t>(sums.size());
  // Correlation over the overlap, in standard deviations.
  const auto score = [&](int64_t lag) {
    const int64_t begin = std::max<int64_t>(0, lag), end = std::min(n, m + lag);
    if (end - begin < least) return 0.0;
    const double energy = (sum_a[end] - sum_a[begin]) * (sum_b[end - lag] - sum_b[begin - lag]);
    if (!(energy > 1e-12)) return 0.0;
    return sums[(lag + size) % size] / std::sqrt(energy) *
           std::sqrt(static_cast<double>(end - begin) / kLevelsPerSample);
  };
  int64_t best = 0;
  double best_score = 0.0, elsewhere = 0.0;
  for (int64_t lag = -(m - least); lag <= n - least; ++lag) {
    if (const double s = score(lag); s > best_score) best_score = s, best = lag;
  }
  for (int64_t lag = -(m - least); lag <= n - least; ++lag) {
    if (std::abs(lag - best) > kPeakReach) elsewhere = std::max(elsewhere, score(lag));
  }
  if (best_score < kLeastScore || best_score < kLeastLead * elsewhere) return std::nullopt;
  // Vertex of the parabola through the peak.
  const double before = score(best - 1), behind = score(best + 1);
  const double bend = before - 2.0 * best_score + behind;
  const double shift = bend < 0.0 ? std::clamp(0.5 * (before - behind) / bend, -0.5, 0.5) : 0.0;
  return (static_cast<double>(best) + shift) / kSoundLevelsPerSecond;
}

}  // namespace color3d
