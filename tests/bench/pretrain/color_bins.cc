#include "tests/bench/pretrain/color_bins.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kCellsPerSide = 25;  // -120 .. 120 Lab units
constexpr int kCenterCell = kCellsPerSide / 2;

int CellOf(float value) {
  const int cell = static_cast<int>(std::lround(value / kColorBinSpacing)) + kCenterCell;
  return std::clamp(cell, 0, kCellsPerSide - 1);
}

}  // namespace

ColorHistogram::ColorHistogram() : counts_(kCellsPerSide * kCellsPerSide, 0.0) {}

void ColorHistogram::Add(const Image& ab) {
  if (ab.channels != 2) throw InvalidArgument("a colour histogram counts 2 channels (a, b)");
  const float* a = ab.Plane(0);
  const float* b = ab.Plane(1);
  for (size_t i = 0; i < ab.PlaneSize(); ++i) {
    counts_[static_cast<size_t>(CellOf(a[i])) * kCellsPerSide + CellOf(b[i])] += 1.0;
  }
}

std::vector<ColorHistogram::Bin> ColorHistogram::Bins(double min_share) const {
  double total = 0.0;
  for (double count : counts_) total += count;
  std::vector<Bin> bins;
  double kept = 0.0;
  for (int i = 0; i < kCellsPerSide; ++i) {
    for (int j = 0; j < kCellsPerSide; ++j) {
      const double count = counts_[static_cast<size_t>(i) * kCellsPerSide + j];
      if (count <= 0.0 || count < min_share * total) continue;
      bins.push_back({{static_cast<float>((i - kCenterCell) * kColorBinSpacing),
                       static_cast<float>((j - kCenterCell) * kColorBinSpacing)},
                      count});
      kept += count;
    }
  }
  for (Bin& bin : bins) bin.share /= kept;
  return bins;
}

std::vector<float> RebalancingWeights(const std::vector<ColorHistogram::Bin>& bins,
                                      double uniform_share,
                                      double power) {
  std::vector<double> weights;
  double mean = 0.0;
  for (const ColorHistogram::Bin& bin : bins) {
    const double mixed =
        (1.0 - uniform_share) * bin.share + uniform_share / static_cast<double>(bins.size());
    weights.push_back(std::pow(mixed, -power));
    mean += bin.share * weights.back();
  }
  std::vector<float> scaled;
  for (double weight : weights) scaled.push_back(static_cast<float>(weight / mean));
  return scaled;
}

}  // namespace color3d
