#include "core/film/steady_tones.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "core/base/error.h"
#include "core/base/median.h"
#include "core/film/tones_of_picture.h"
#include "core/image/box_mean.h"
#include "core/image/optical_flow.h"
#include "core/image/plane_sampling.h"

namespace color3d {
namespace {

constexpr int kTones = 17;          // of a curve
constexpr int kReach = 12;          // frames to either side
constexpr int kKnots = 15;          // of a step: quantiles of the matched pixels
constexpr double kMinShare = 0.15;  // of the pixels that must be matched
constexpr double kCyclePx = 1.0;
constexpr double kSteadyL = 0.2;  // jumps within the error of measurement

double ToneAt(int i) { return 100.0 * i / (kTones - 1); }

// Map from the tones of a frame to those of the next one, both ascending.
struct ToneStep {
  std::array<double, kKnots> from{}, to{};
};

// Linear between knots; beyond them the difference of the last knot.
double Mapped(double tone,
              const std::array<double, kKnots>& from,
              const std::array<double, kKnots>& to) {
  if (tone <= from.front()) return tone + to.front() - from.front();
  if (tone >= from.back()) return tone + to.back() - from.back();
  const auto above =
      static_cast<size_t>(std::upper_bound(from.begin(), from.end(), tone) - from.begin());
  const double share = (tone - from[above - 1]) / (from[above] - from[above - 1]);
  return std::lerp(to[above - 1], to[above], share);
}

// Normalises exposure and contrast for optical flow.
Image ForFlow(const Image& picture) {
  const TonesOfPicture tones(picture);
  const double deviation = std::max(1.0, tones.deviation);
  Image out = picture;
  for (float& v : out.data) {
    v = static_cast<float>(std::clamp(50.0 + 20.0 * (v - tones.mean) / deviation, 0.0, 100.0));
  }
  return out;
}

// Collects the tones of matched places in both frames.
void CollectPairs(const Image& one,
                  const Image& other,
                  const Image& flow,
                  const Image& back,
                  std::vector<float>* of_one,
                  std::vector<float>* of_other) {
  for (int y = 0; y < one.height; ++y) {
    for (int x = 0; x < one.width; ++x) {
      const double u = x + flow.At(0, y, x), v = y + flow.At(1, y, x);
      if (u < 0.0 || v < 0.0 || u > one.width - 1.0 || v > one.height - 1.0) continue;
      const double cycle =
          std::hypot(u + SampleBilinear(back, 0, u, v) - x, v + SampleBilinear(back, 1, u, v) - y);
      if (cycle > kCyclePx) continue;
      of_one->push_back(one.At(0, y, x));
      of_other->push_back(SampleBilinear(other, 0, u, v));
    }
  }
}

std::array<double, kKnots> Quantiles(std::vector<float> values) {
  std::sort(values.begin(), values.end());
  std::array<double, kKnots> knots{};
  const size_t n = values.size();
  for (int k = 0; k < kKnots; ++k) {
    // The mean around the quantile is steadier than a single value.
    const size_t begin = n * k / kKnots, end = std::max(begin + 1, n * (k + 1) / kKnots);
    double sum = 0.0;
    for (size_t i = begin; i < end; ++i) sum += values[i];
    knots[k] = sum / static_cast<double>(end - begin);
  }
  constexpr double kApart = 0.05;
  for (int k = 1; k < kKnots; ++k) knots[k] = std::max(knots[k], knots[k - 1] + kApart);
  return knots;
}

// Nothing where too few pixels match; the exposure then counts as unchanged.
std::optional<ToneStep> StepBetween(const Image& one, const Image& next) {
  const Image flow_one = ForFlow(one), flow_next = ForFlow(next);
  const Image there = DenseFlow(flow_one, flow_next), back = DenseFlow(flow_next, flow_one);
  // In both directions, so that sampling blurs both frames alike.
  std::vector<float> of_one, of_next;
  CollectPairs(one, next, there, back, &of_one, &of_next);
  CollectPairs(next, one, back, there, &of_next, &of_one);
  if (static_cast<double>(of_one.size()) < 2.0 * kMinShare * static_cast<double>(one.PlaneSize())) {
    return std::nullopt;
  }
  return ToneStep{Quantiles(std::move(of_one)), Quantiles(std::move(of_next))};
}

// Mean difference in L between a step and those before and after it: jumps of exposure. Even
// changes, as in a fade, count nothing.
double Jumps(const std::vector<std::optional<ToneStep>>& steps) {
  double sum = 0.0;
  int count = 0;
  for (size_t k = 1; k + 1 < steps.size(); ++k) {
    if (!steps[k - 1] || !steps[k] || !steps[k + 1]) continue;
    for (int i = 0; i < kKnots; ++i, ++count) {
      const auto change = [&](size_t s) { return steps[s]->to[i] - steps[s]->from[i]; };
      sum += std::abs(change(k) - 0.5 * (change(k - 1) + change(k + 1)));
    }
  }
  return count > 0 ? sum / count : 0.0;
}

// Value at 0 of a line through the points (offset, value), fitted robustly.
double LineAtZero(const std::vector<double>& offsets, const std::vector<double>& values) {
  constexpr int kRounds = 3;
  std::vector<double> weights, rests(values.size());
  for (const double offset : offsets) {
    const double u = offset / (kReach + 1.0);
    weights.push_back((1.0 - u * u) * (1.0 - u * u));
  }
  std::vector<double> robust = weights;
  double at_zero = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    double w = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
    for (size_t i = 0; i < values.size(); ++i) {
      w += robust[i];
      x += robust[i] * offsets[i];
      y += robust[i] * values[i];
      xx += robust[i] * offsets[i] * offsets[i];
      xy += robust[i] * offsets[i] * values[i];
    }
    const double spread = w * xx - x * x;
    const double slope = spread > 1e-9 ? (w * xy - x * y) / spread : 0.0;
    at_zero = (y - slope * x) / w;
    for (size_t i = 0; i < values.size(); ++i) {
      rests[i] = std::abs(values[i] - at_zero - slope * offsets[i]);
    }
    const double usual = std::max(0.2, 3.0 * Median(rests));
    for (size_t i = 0; i < values.size(); ++i) {
      robust[i] = weights[i] / (1.0 + (rests[i] / usual) * (rests[i] / usual));
    }
  }
  return at_zero;
}

// Curve of the frame at `at` of a shot. steps[k] leads from its frame k to k + 1.
ToneCurve FitCurve(const std::vector<std::optional<ToneStep>>& steps, int at) {
  const int count = static_cast<int>(steps.size()) + 1;
  const int first = std::max(0, at - kReach), last = std::min(count - 1, at + kReach);
  std::vector<double> offsets;
  for (int s = first; s <= last; ++s) offsets.push_back(s - at);
  ToneCurve curve(kTones);
  std::vector<double> values(offsets.size());
  for (int i = 0; i < kTones; ++i) {
    const double tone = ToneAt(i);
    values[at - first] = tone;
    for (int s = at + 1; s <= last; ++s) {
      const double before = values[s - 1 - first];
      values[s - first] =
          steps[s - 1] ? Mapped(before, steps[s - 1]->from, steps[s - 1]->to) : before;
    }
    for (int s = at - 1; s >= first; --s) {
      const double after = values[s + 1 - first];
      values[s - first] = steps[s] ? Mapped(after, steps[s]->to, steps[s]->from) : after;
    }
    curve[i] = static_cast<float>(std::clamp(LineAtZero(offsets, values), 0.0, 100.0));
    if (i > 0) curve[i] = std::max(curve[i], curve[i - 1]);
  }
  return curve;
}

float MappedTone(const ToneCurve& curve, double tone) {
  if (curve.empty()) return static_cast<float>(tone);
  const double place = std::clamp(tone, 0.0, 100.0) / 100.0 * (kTones - 1);
  const int below = std::min(static_cast<int>(place), kTones - 2);
  return std::lerp(curve[below], curve[below + 1], static_cast<float>(place - below));
}

}  // namespace

SteadyTones FindSteadyTones(const std::vector<Image>& pictures,
                            const std::vector<int>& shot,
                            ThreadPool& pool,
                            const CancellationToken& cancel) {
  if (shot.size() != pictures.size()) {
    throw InvalidArgument(
        "there are {} frames, but shot numbers for {}", pictures.size(), shot.size());
  }
  std::map<int, std::vector<int>> frames_of_shot;
  for (size_t i = 0; i < pictures.size(); ++i) {
    if (pictures[i].channels != 1 || pictures[i].Empty() ||
        pictures[i].width != pictures[0].width || pictures[i].height != pictures[0].height) {
      throw InvalidArgument("the frames of a film must have one channel and equal sizes");
    }
    frames_of_shot[shot[i]].push_back(static_cast<int>(i));
  }
  SteadyTones result;
  result.curves.resize(pictures.size());
  double before = 0.0, after = 0.0;
  int64_t compared = 0;
  for (const auto& shot_frames : frames_of_shot) {
    const std::vector<int>& frames = shot_frames.second;
    const auto count = static_cast<int64_t>(frames.size());
    if (count < 3) continue;
    std::vector<std::optional<ToneStep>> steps(count - 1);
    pool.ForEach(count - 1, [&](int64_t k, int) {
      cancel.ThrowIfCancelled();
      steps[k] = StepBetween(BoxMean(pictures[frames[k]], 1), BoxMean(pictures[frames[k + 1]], 1));
    });
    if (Jumps(steps) >= kSteadyL) {
      pool.ForEach(count, [&](int64_t k, int) {
        cancel.ThrowIfCancelled();
        result.curves[frames[k]] = FitCurve(steps, static_cast<int>(k));
      });
    }
    for (int64_t k = 0; k + 1 < count; ++k) {
      if (!steps[k]) continue;
      for (int i = 0; i < kKnots; ++i) {
        const double from = steps[k]->from[i], to = steps[k]->to[i];
        before += std::abs(to - from);
        after += std::abs(MappedTone(result.curves[frames[k + 1]], to) -
                          MappedTone(result.curves[frames[k]], from));
        ++compared;
      }
    }
  }
  if (compared > 0) {
    result.flicker_before = before / static_cast<double>(compared);
    result.flicker_after = after / static_cast<double>(compared);
  }
  return result;
}

Image ApplyToneCurve(Image luminance, const ToneCurve& curve) {
  if (curve.empty()) return luminance;
  for (float& v : luminance.data) v = MappedTone(curve, v);
  return luminance;
}

}  // namespace color3d
