// Detects that the curve of the held-out error is flat. No torch. Not thread-safe.
#pragma once

#include <vector>

namespace color3d {

struct EarlyStopOptions {
  // Relative fall of the smoothed error over `window` points below which training stops; 0: never.
  double min_improvement = 0.0;
  int smoothing = 3;  // points in a mean
  int window = 4;
};

class EarlyStop {
 public:
  explicit EarlyStop(const EarlyStopOptions& options) : options_(options) {}

  // Adds a point of the curve. Returns true if training should stop.
  bool Add(double error) {
    errors_.push_back(error);
    const int now = static_cast<int>(errors_.size());
    const int earlier = now - options_.window;
    if (options_.min_improvement <= 0.0 || earlier < options_.smoothing) return false;
    return Mean(earlier) - Mean(now) < options_.min_improvement * Mean(earlier);
  }

 private:
  double Mean(int end) const {
    double sum = 0.0;
    for (int i = end - options_.smoothing; i < end; ++i) sum += errors_[i];
    return sum / options_.smoothing;
  }

  EarlyStopOptions options_;
  std::vector<double> errors_;
};

}  // namespace color3d
