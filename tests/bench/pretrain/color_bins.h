// Colours as classes: cells of the ab plane, so that a colourizer can predict "red or blue" instead
// of the grey in between (Zhang, Isola & Efros 2016). Plain values, no torch, thread-safe.
#pragma once

#include <array>
#include <vector>

#include "core/base/image.h"

namespace color3d {

inline constexpr double kColorBinSpacing = 10.0;  // Lab units between neighbouring centres

// Counts how often each cell of the ab plane occurs.
class ColorHistogram {
 public:
  ColorHistogram();
  // `ab`: 2 channels, Lab units.
  void Add(const Image& ab);

  struct Bin {
    std::array<float, 2> center_ab;
    double share = 0.0;  // share of all counted pixels, > 0; sums to 1 over the bins
  };
  // Returns the cells with at least `min_share` of all counts, in a fixed order.
  std::vector<Bin> Bins(double min_share) const;

 private:
  std::vector<double> counts_;
};

// Weight of a bin in training: share^-power of the share mixed with a uniform one, scaled so that
// the mean over the data is 1. Lifts rare, colourful bins (power 0: none, 1: all equal).
std::vector<float> RebalancingWeights(const std::vector<ColorHistogram::Bin>& bins,
                                      double uniform_share,
                                      double power);

}  // namespace color3d
