#include "client/lib/photos/photo_color.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/color/lab.h"
#include "core/image/codec.h"

namespace color3d::client {
namespace {

// At this size pixel noise averages out, but hues of objects do not.
constexpr int kSidePx = 32;
constexpr size_t kTones = 12;
// Lab units: differences caused by compression and uneven toning.
constexpr double kOtherColor = 6.0;
// A tone with less chroma has no hue.
constexpr double kNeutral = 3.0;
const double kSameHue = std::tan(30.0 * M_PI / 180.0);
// Maximum chroma of a stain that still counts as tone: three times as much, plus a constant.
constexpr double kStainGain = 3.0, kStainMore = 10.0;

// Measured: sepia prints, also stained ones, and old film have at most 2 % and 0.7 Lab units;
// colour photos have at least 5 % and 1.5 Lab units, except for yellow fruit on a grey carpet with
// 0.4.
constexpr double kSecondHueOfColor = 0.04;
constexpr double kSecondHueOfPrint = 0.01;
constexpr double kScatterOfColor = 1.2;
constexpr double kScatterOfPrint = 0.7;

struct Chroma {
  double a = 0.0;
  double b = 0.0;
  double Length() const { return std::hypot(a, b); }
};

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Median chroma of pixels of similar luminance, as a curve over L with equally many pixels in each
// bin.
class Tone {
 public:
  explicit Tone(const Image& lab) {
    std::vector<size_t> order(lab.PlaneSize());
    std::iota(order.begin(), order.end(), size_t{0});
    std::ranges::sort(order, {}, [&](size_t i) { return lab.Plane(0)[i]; });
    for (size_t k = 0; k < kTones; ++k) {
      const size_t begin = order.size() * k / kTones, end = order.size() * (k + 1) / kTones;
      if (begin == end) continue;
      std::vector<double> plane[3];
      for (size_t i = begin; i < end; ++i) {
        for (int c = 0; c < 3; ++c) plane[c].push_back(lab.Plane(c)[order[i]]);
      }
      knots_.push_back({Median(plane[0]), {Median(plane[1]), Median(plane[2])}});
      mean_.a += knots_.back().chroma.a;
      mean_.b += knots_.back().chroma.b;
    }
    mean_.a /= static_cast<double>(knots_.size());
    mean_.b /= static_cast<double>(knots_.size());
  }

  Chroma At(double l) const {
    if (l <= knots_.front().l) return knots_.front().chroma;
    for (size_t k = 1; k < knots_.size(); ++k) {
      const Knot &low = knots_[k - 1], &high = knots_[k];
      if (l > high.l) continue;
      const double t = high.l > low.l ? (l - low.l) / (high.l - low.l) : 0.0;
      return {low.chroma.a + t * (high.chroma.a - low.chroma.a),
              low.chroma.b + t * (high.chroma.b - low.chroma.b)};
    }
    return knots_.back().chroma;
  }
  const Chroma& mean() const { return mean_; }

 private:
  struct Knot {
    double l = 0.0;
    Chroma chroma;
  };
  std::vector<Knot> knots_;
  Chroma mean_;
};

}  // namespace

HueSpread MeasureHues(const Image& srgb) {
  if (srgb.channels != 3 || srgb.Empty()) return {};
  const Image lab = LabFromSrgb(FitWithin(srgb, kSidePx));
  const Tone tone(lab);
  const double strength = tone.mean().Length();
  const bool is_toned = strength >= kNeutral;
  HueSpread spread;
  std::vector<double> off_tone;
  for (size_t i = 0; i < lab.PlaneSize(); ++i) {
    const Chroma own{lab.Plane(1)[i], lab.Plane(2)[i]};
    const Chroma expected = tone.At(lab.Plane(0)[i]);
    const double other = std::hypot(own.a - expected.a, own.b - expected.b);
    double off_hue = other;
    bool same_hue = false;
    if (is_toned) {
      const double along = (own.a * tone.mean().a + own.b * tone.mean().b) / strength;
      const double across = std::abs(own.b * tone.mean().a - own.a * tone.mean().b) / strength;
      off_hue = along >= 0.0 ? across : own.Length();
      same_hue = along > 0.0 && across <= along * kSameHue &&
                 own.Length() < kStainGain * expected.Length() + kStainMore;
    }
    off_tone.push_back(std::min(off_hue, other));
    if (other > kOtherColor && !same_hue) spread.second_hue += 1.0;
  }
  spread.second_hue /= static_cast<double>(lab.PlaneSize());
  spread.scatter = Median(std::move(off_tone));
  return spread;
}

ColorVerdict JudgeColor(const HueSpread& hues) {
  const bool scatters = hues.scatter >= kScatterOfColor && hues.second_hue >= kSecondHueOfPrint;
  const bool has_second_hue = hues.second_hue >= kSecondHueOfColor;
  ColorVerdict verdict;
  verdict.in_color = has_second_hue || scatters;
  verdict.is_sure =
      verdict.in_color ? hues.scatter >= kScatterOfPrint : hues.second_hue < kSecondHueOfPrint;
  return verdict;
}

bool HasColor(const Image& srgb) { return JudgeColor(MeasureHues(srgb)).in_color; }

}  // namespace color3d::client
