// Selects views to colour by the expected error of the colours of all views (STILL.md "Stage 1a"):
// small where a key view shows the same place, larger where colours are inferred, and increasing
// with the feature distance to the key views. Pure functions, thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/keyview/coverage.h"

namespace color3d {

// CIEDE2000 by provenance of the colour, measured on scenes without tuning.
inline constexpr double kErrorSeen = 2.5;
inline constexpr double kErrorInferred = 7.0;
inline constexpr double kErrorGuessed = 10.0;

// Visibility between views: `samples` places in each view, and the other views that show them.
class SeenSamples {
 public:
  SeenSamples(int views, int samples)
      : views_(views), samples_(samples), seen_(static_cast<size_t>(views) * views * samples, 0) {}
  int views() const { return views_; }
  int samples() const { return samples_; }  // per view
  bool IsSeen(int by, int view, int sample) const { return seen_[Index(by, view, sample)] != 0; }
  void SetSeen(int by, int view, int sample) { seen_[Index(by, view, sample)] = 1; }
  // Number of samples that bounds the size of the table.
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
  std::vector<double> error;  // expected error over all views, with the first 1, 2, ... key views
};

// Chooses `count` of the allowed views; `first` >= 0 fixes the first one. Greedy, then exchanges
// each view but a fixed first one while the error decreases. Requires: `seen` and `distances` are
// of the same views; either may be empty (no samples, no queries). Throws Error{kInvalidArgument}
// if fewer views are allowed.
ChosenKeyViews ChooseKeyViews(const SeenSamples& seen,
                              const NearestDistances& distances,
                              const std::vector<bool>& allowed,
                              int count,
                              int first = -1);

// Expected error of a set of key views, as in ChooseKeyViews.
double ExpectedError(const SeenSamples& seen,
                     const NearestDistances& distances,
                     const std::vector<int>& keys);

struct NextKeyViewAdvice {
  int view = 0;
  double error_now = 0.0;   // expected error with the current key views
  double error_with = 0.0;  // expected error with this view as additional key view
};

// Returns the best view to add to `keys`, or nothing if no view reduces the error notably.
std::optional<NextKeyViewAdvice> NextKeyView(const SeenSamples& seen,
                                             const NearestDistances& distances,
                                             const std::vector<int>& keys);

}  // namespace color3d
