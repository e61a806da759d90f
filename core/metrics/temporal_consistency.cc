#include "core/metrics/temporal_consistency.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "core/base/error.h"
#include "core/base/evenly.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/flow_agreement.h"
#include "core/image/optical_flow.h"
#include "core/image/plane_sampling.h"

namespace color3d {
namespace {

constexpr int kStretch = 16;  // number of neighbouring frames that one thread compares
constexpr size_t kMostStretches = 16;
constexpr int kReach = kCdcDistances.back();

// Frames [begin, end) of a shot; each is compared with earlier ones.
struct FrameRange {
  const std::vector<int>* shot = nullptr;
  int begin = 1;
  int end = 1;
};

std::vector<FrameRange> SplitShots(const std::vector<std::vector<int>>& shots) {
  std::vector<FrameRange> stretches;
  for (const std::vector<int>& shot : shots) {
    const int frames = static_cast<int>(shot.size());
    for (int begin = 1; begin < frames; begin += kStretch) {
      stretches.push_back({&shot, begin, std::min(begin + kStretch, frames)});
    }
  }
  return PickEvenly(std::move(stretches), kMostStretches);
}

// Sums for one colouring of a stretch.
struct Sums {
  ChromaAlongMotion chroma;
  std::array<double, 3> divergence = {};
  std::array<int, 3> count = {};

  void Add(const Sums& other) {
    chroma.Add(other.chroma);
    for (size_t d = 0; d < divergence.size(); ++d) {
      divergence[d] += other.divergence[d];
      count[d] += other.count[d];
    }
  }
};

TemporalConsistency Result(const Sums& sums) {
  TemporalConsistency result;
  result.pairs = sums.count[0];
  int distances = 0;
  for (size_t d = 0; d < sums.count.size(); ++d) {
    if (sums.count[d] == 0) continue;
    result.cdc_at[d] = sums.divergence[d] / sums.count[d];
    result.cdc += result.cdc_at[d];
    ++distances;
  }
  if (distances > 0) result.cdc /= distances;
  const ChromaAlongMotion& chroma = sums.chroma;
  if (chroma.pixels > 0) {
    const auto pixels = static_cast<double>(chroma.pixels);
    result.followed = pixels / static_cast<double>(chroma.all_pixels);
    result.tc_chroma = chroma.difference / pixels;
    result.chroma = chroma.chroma / pixels;
  }
  return result;
}

// Data of earlier frames that later frames are compared with.
struct Remembered {
  Image ab;                               // of the last frame only
  std::deque<ColorHistogram> histograms;  // the newest first
};

std::vector<Sums> Compare(const FrameRange& stretch,
                          const TemporalSource& source,
                          const CancellationToken& cancel) {
  const size_t colorings = source.colorings.size();
  std::vector<Sums> sums(colorings);
  std::vector<Remembered> before(colorings);
  Image luminance_before;
  for (int i = std::max(0, stretch.begin - kReach); i < stretch.end; ++i) {
    cancel.ThrowIfCancelled();
    const int frame = (*stretch.shot)[i];
    const bool compared = i >= stretch.begin;
    Image luminance;
    FollowedPixels followed;
    if (i + 1 >= stretch.begin) luminance = source.luminance(frame);
    if (compared) followed = FollowToPreviousFrame(luminance, luminance_before);
    for (size_t k = 0; k < colorings; ++k) {
      const Image lab = source.colorings[k](frame);
      const ColorHistogram histogram = HistogramOf(SrgbFromLab(lab));
      Image ab = ChromaOfLab(lab);
      Remembered& past = before[k];
      if (compared) {
        sums[k].chroma.Add(ab, past.ab, followed);
        for (size_t d = 0; d < kCdcDistances.size(); ++d) {
          if (i < kCdcDistances[d]) continue;
          sums[k].divergence[d] += Divergence(histogram, past.histograms[kCdcDistances[d] - 1]);
          ++sums[k].count[d];
        }
      }
      past.ab = std::move(ab);
      past.histograms.push_front(histogram);
      if (past.histograms.size() > kReach) past.histograms.pop_back();
    }
    luminance_before = std::move(luminance);
  }
  return sums;
}

}  // namespace

ColorHistogram HistogramOf(const Image& srgb) {
  if (srgb.channels != 3 || srgb.Empty()) {
    throw InvalidArgument("a histogram of colours needs 3 channels, got {}", srgb.channels);
  }
  ColorHistogram histogram = {};
  const double share = 1.0 / static_cast<double>(srgb.PlaneSize());
  for (int c = 0; c < 3; ++c) {
    std::array<int64_t, 256> count = {};
    const float* plane = srgb.Plane(c);
    for (size_t i = 0; i < srgb.PlaneSize(); ++i) {
      ++count[static_cast<size_t>(255.0f * std::clamp(plane[i], 0.0f, 1.0f) + 0.5f)];
    }
    for (size_t v = 0; v < count.size(); ++v) {
      histogram[c][v] = static_cast<float>(share * static_cast<double>(count[v]));
    }
  }
  return histogram;
}

double Divergence(const ColorHistogram& one, const ColorHistogram& other) {
  double sum = 0.0;
  for (size_t c = 0; c < one.size(); ++c) {
    for (size_t v = 0; v < one[c].size(); ++v) {
      const double p = one[c][v], q = other[c][v], mean = 0.5 * (p + q);
      if (p > 0.0) sum += 0.5 * p * std::log(p / mean);
      if (q > 0.0) sum += 0.5 * q * std::log(q / mean);
    }
  }
  return std::max(0.0, sum / static_cast<double>(one.size()));
}

FollowedPixels FollowToPreviousFrame(const Image& luminance, const Image& luminance_before) {
  const Image back = DenseFlow(luminance, luminance_before);
  const Image forth = DenseFlow(luminance_before, luminance);
  const int width = luminance.width, height = luminance.height;
  FollowedPixels followed{Image(width, height, 2), std::vector<char>(luminance.PlaneSize(), 0)};
  constexpr int kSmallestSide = 32;  // optical flow of smaller pictures is 0
  const bool too_small = std::min(width, height) < kSmallestSide;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float bx = back.At(0, y, x), by = back.At(1, y, x);
      const float u = static_cast<float>(x) + bx, v = static_cast<float>(y) + by;
      followed.place.At(0, y, x) = u;
      followed.place.At(1, y, x) = v;
      if (too_small || u < 0.0f || v < 0.0f || u > static_cast<float>(width - 1) ||
          v > static_cast<float>(height - 1)) {
        continue;
      }
      const BilinearPlace at(width, height, u, v);
      followed.sure[static_cast<size_t>(y) * width + x] =
          FlowAgrees(bx, by, at.Of(forth.Plane(0)), at.Of(forth.Plane(1)));
    }
  }
  return followed;
}

void ChromaAlongMotion::Add(const Image& ab,
                            const Image& ab_before,
                            const FollowedPixels& followed) {
  const Image& place = followed.place;
  for (const Image* image : {&ab, &ab_before}) {
    if (image->channels == 2 && image->width == place.width && image->height == place.height) {
      continue;
    }
    throw InvalidArgument("the colours of a frame are {}x{} px of {} channels, its flow {}x{}",
                          image->width,
                          image->height,
                          image->channels,
                          place.width,
                          place.height);
  }
  all_pixels += static_cast<int64_t>(place.PlaneSize());
  for (size_t i = 0; i < place.PlaneSize(); ++i) {
    if (!followed.sure[i]) continue;
    const BilinearPlace before(place.width, place.height, place.Plane(0)[i], place.Plane(1)[i]);
    const double a = ab.Plane(0)[i], b = ab.Plane(1)[i];
    const double da = a - before.Of(ab_before.Plane(0)), db = b - before.Of(ab_before.Plane(1));
    difference += std::sqrt(da * da + db * db);
    chroma += std::sqrt(a * a + b * b);
    ++pixels;
  }
}

void ChromaAlongMotion::Add(const ChromaAlongMotion& other) {
  pixels += other.pixels;
  all_pixels += other.all_pixels;
  difference += other.difference;
  chroma += other.chroma;
}

std::map<std::string, double> TemporalConsistency::Figures() const {
  std::map<std::string, double> figures = {
      {"followed", followed}, {"tc_chroma", tc_chroma}, {"chroma", chroma}, {"cdc", cdc}};
  for (size_t d = 0; d < kCdcDistances.size(); ++d) {
    figures["cdc_" + std::to_string(kCdcDistances[d])] = cdc_at[d];
  }
  return figures;
}

std::vector<TemporalConsistency> MeasureTemporalConsistency(const TemporalSource& source,
                                                            ThreadPool& pool,
                                                            const CancellationToken& cancel) {
  const std::vector<FrameRange> stretches = SplitShots(source.shots);
  std::vector<std::vector<Sums>> sums(stretches.size());
  pool.ForEach(static_cast<int64_t>(stretches.size()),
               [&](int64_t i, int) { sums[i] = Compare(stretches[i], source, cancel); });
  std::vector<TemporalConsistency> results;
  for (size_t k = 0; k < source.colorings.size(); ++k) {
    Sums all;
    for (const std::vector<Sums>& of_stretch : sums) all.Add(of_stretch[k]);
    results.push_back(Result(all));
  }
  return results;
}

}  // namespace color3d
