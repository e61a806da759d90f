// Which views to colour, judged by the error that is expected of the colours of all views
// (STILL.md "Stage 1a"): small where a key view shows the same place, larger where colours have to
// be inferred, the more so the stranger a place is to the key views. Pure, thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/keyview/coverage.h"

namespace color3d {

// CIEDE2000, as scenes that nobody tuned on measure: where a pixel's colour comes from.
inline constexpr double kErrorSeen = 2.5;
inline constexpr double kErrorInferred = 7.0;
inline constexpr double kErrorGuessed = 10.0;

// What views see of each other: `samples` places in each view, and who else shows them.
class SeenSamples {
 public:
  SeenSamples(int views, int samples)
      : views_(views), samples_(samples), seen_(static_cast<size_t>(views) * views * samples, 0) {}
  int views() const { return views_; }
  int samples() const { return samples_; }  // per view
  bool IsSeen(int by, int view, int sample) const { return seen_[Index(by, view, sample)] != 0; }
  void SetSeen(int by, int view, int sample) { seen_[Index(by, view, sample)] = 1; }
  // So many samples that the table stays small.
  static int SamplesFor(int views, int wanted);

 private:
  size_t Index(int by, int view, int sample) const {
    return (static_cast<size_t>(by) * views_ + view) * samples_ + sample;
  }
  int views_;
  int samples_;
  std::vector<uint8_t> seen_;
};

struct ChosenKeyViews {
  std::vector<int> views;     // best first
  std::vector<double> error;  // expected over all views with the first, the first two, ...
};

// `count` of the views that may be chosen; `first` >= 0 is the first whatever it costs. Greedy,
// then each but a given first one is exchanged while that helps. `seen` and `distances` are of the
// same views; either may tell nothing (no samples, no queries). Throws Error{kInvalidArgument} when
// fewer views may be chosen.
ChosenKeyViews ChooseKeyViews(const SeenSamples& seen,
                              const NearestDistances& distances,
                              const std::vector<bool>& allowed,
                              int count,
                              int first = -1);

// The error that ChooseKeyViews expects of a set.
double ExpectedError(const SeenSamples& seen,
                     const NearestDistances& distances,
                     const std::vector<int>& keys);

struct NextKeyViewAdvice {
  int view = 0;
  double error_now = 0.0;   // expected with the key views that there are
  double error_with = 0.0;  // ... with this view coloured, too
};

// The view to colour after `keys`. Nothing when none saves anything worth telling.
std::optional<NextKeyViewAdvice> NextKeyView(const SeenSamples& seen,
                                             const NearestDistances& distances,
                                             const std::vector<int>& keys);

}  // namespace color3d
