#include "core/splat/geometry/exposure.h"

#include <cmath>

namespace color3d {
namespace {

constexpr double kBeta1 = 0.9, kBeta2 = 0.99, kEpsilon = 1e-8;

double Stepped(double gradient, double rate, int k, PhotoExposure& e) {
  e.first[k] += (1.0 - kBeta1) * (gradient - e.first[k]);
  e.second[k] += (1.0 - kBeta2) * (gradient * gradient - e.second[k]);
  const double n = static_cast<double>(e.steps);
  const double first = e.first[k] / (1.0 - std::pow(kBeta1, n));
  const double second = e.second[k] / (1.0 - std::pow(kBeta2, n));
  return rate * first / (std::sqrt(second) + kEpsilon);
}

}  // namespace

void Expose(const PhotoExposure& exposure,
            const PlaneBuffer& drawn,
            ThreadPool& pool,
            PlaneBuffer& exposed) {
  exposed.Reset(drawn.width, drawn.height, drawn.channels);
  const auto gain = static_cast<float>(std::exp(exposure.log_gain));
  const auto offset = static_cast<float>(exposure.offset);
  pool.ForRanges(int64_t{drawn.channels} * drawn.height, [&](int64_t begin, int64_t end, int) {
    for (int64_t row = begin; row < end; ++row) {
      const int c = static_cast<int>(row / drawn.height);
      const int y = static_cast<int>(row % drawn.height);
      const float* in = drawn.Row(c, y);
      float* out = exposed.Row(c, y);
      for (int x = 0; x < drawn.width; ++x) out[x] = gain * in[x] + offset;
    }
  });
}

void FitExposure(const PlaneBuffer& drawn,
                 double rate,
                 double prior,
                 ThreadPool& pool,
                 PlaneBuffer& d_exposed,
                 PhotoExposure& exposure) {
  const int64_t rows = int64_t{drawn.channels} * drawn.height;
  const double gain = std::exp(exposure.log_gain);
  std::vector<double> sum(2 * rows, 0.0);
  pool.ForRanges(rows, [&](int64_t begin, int64_t end, int) {
    for (int64_t row = begin; row < end; ++row) {
      const int c = static_cast<int>(row / drawn.height);
      const int y = static_cast<int>(row % drawn.height);
      const float* value = drawn.Row(c, y);
      float* d = d_exposed.Row(c, y);
      double by_gain = 0.0, by_offset = 0.0;
      for (int x = 0; x < drawn.width; ++x) {
        by_gain += static_cast<double>(d[x]) * value[x];
        by_offset += d[x];
        d[x] *= static_cast<float>(gain);
      }
      sum[2 * row] = by_gain;
      sum[2 * row + 1] = by_offset;
    }
  });
  double by_gain = 0.0, by_offset = 0.0;
  for (int64_t row = 0; row < rows; ++row) {
    by_gain += sum[2 * row];
    by_offset += sum[2 * row + 1];
  }
  ++exposure.steps;
  exposure.log_gain -= Stepped(gain * by_gain + 2.0 * prior * exposure.log_gain, rate, 0, exposure);
  exposure.offset -= Stepped(by_offset + 2.0 * prior * exposure.offset, rate, 1, exposure);
}

void Recenter(Exposures& exposures) {
  double log_gain = 0.0, offset = 0.0;
  for (const PhotoExposure& e : exposures) {
    log_gain += e.log_gain / static_cast<double>(exposures.size());
    offset += e.offset / static_cast<double>(exposures.size());
  }
  for (PhotoExposure& e : exposures) {
    e.log_gain -= log_gain;
    e.offset -= offset;
  }
}

}  // namespace color3d
