#include "core/metrics/quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr double kInfinitePsnrDb = 99.0;
constexpr int kRadius = 5;  // of the 11-tap window
constexpr double kSigma = 1.5;

std::string Shape(const Image& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height) + " x " +
         std::to_string(image.channels);
}

void CheckPair(const Image& x, const Image& y) {
  if (x.Empty() || x.width != y.width || x.height != y.height || x.channels != y.channels) {
    throw InvalidArgument(
        "pictures to compare must have one size, got {} and {}", Shape(x), Shape(y));
  }
}

void CheckPeak(double peak) {
  if (!(peak > 0.0) || !std::isfinite(peak)) {
    throw InvalidArgument("peak is {}; it must be positive", peak);
  }
}

std::array<double, 2 * kRadius + 1> Window() {
  std::array<double, 2 * kRadius + 1> window{};
  double sum = 0.0;
  for (int i = -kRadius; i <= kRadius; ++i) {
    window[i + kRadius] = std::exp(-0.5 * i * i / (kSigma * kSigma));
    sum += window[i + kRadius];
  }
  for (double& w : window) w /= sum;
  return window;
}

// Five filtered moments of one row: x, y, x^2, y^2, xy. Doubles, because sigma^2 = E[x^2] - E[x]^2
// cancels: in float a flat picture with L near 100 would show structure.
constexpr int kMoments = 5;
using Row = std::vector<std::array<double, kMoments>>;

void FilterAlongRow(const float* x,
                    const float* y,
                    int width,
                    const std::array<double, 2 * kRadius + 1>& window,
                    Row* out) {
  for (int c = 0; c < width; ++c) {
    std::array<double, kMoments> sum{};
    const int first = std::max(0, c - kRadius);
    const int last = std::min(width - 1, c + kRadius);
    for (int i = first; i <= last; ++i) {
      const double w = window[i - c + kRadius];
      const double a = x[i];
      const double b = y[i];
      sum[0] += w * a;
      sum[1] += w * b;
      sum[2] += w * a * a;
      sum[3] += w * b * b;
      sum[4] += w * a * b;
    }
    (*out)[c] = sum;
  }
}

double SsimOfMoments(const std::array<double, kMoments>& m, double c1, double c2) {
  const double var_x = m[2] - m[0] * m[0];
  const double var_y = m[3] - m[1] * m[1];
  const double covariance = m[4] - m[0] * m[1];
  return (2.0 * m[0] * m[1] + c1) * (2.0 * covariance + c2) /
         ((m[0] * m[0] + m[1] * m[1] + c1) * (var_x + var_y + c2));
}

// Sum of the SSIM map of one channel (Wang et al. 2004, equation 13).
double SsimSum(const float* x, const float* y, int width, int height, double c1, double c2) {
  const auto window = Window();
  std::vector<Row> ring(2 * kRadius + 1, Row(width));
  double sum = 0.0;
  for (int r = 0; r < height + kRadius; ++r) {
    if (r < height) {
      const size_t at = static_cast<size_t>(r) * width;
      FilterAlongRow(x + at, y + at, width, window, &ring[r % ring.size()]);
    }
    const int center = r - kRadius;
    if (center < 0) continue;
    const int first = std::max(0, center - kRadius);
    const int last = std::min(height - 1, center + kRadius);
    for (int c = 0; c < width; ++c) {
      std::array<double, kMoments> m{};
      for (int i = first; i <= last; ++i) {
        const double w = window[i - center + kRadius];
        const auto& row = ring[i % ring.size()][c];
        for (int k = 0; k < kMoments; ++k) m[k] += w * row[k];
      }
      sum += SsimOfMoments(m, c1, c2);
    }
  }
  return sum;
}

}  // namespace

double Psnr(const Image& x, const Image& y, double peak) {
  CheckPair(x, y);
  CheckPeak(peak);
  double sum = 0.0;
  for (size_t i = 0; i < x.data.size(); ++i) {
    const double d = static_cast<double>(x.data[i]) - y.data[i];
    sum += d * d;
  }
  const double mse = sum / static_cast<double>(x.data.size());
  if (mse <= 0.0) return kInfinitePsnrDb;
  return std::min(10.0 * std::log10(peak * peak / mse), kInfinitePsnrDb);
}

double Ssim(const Image& x, const Image& y, double peak) {
  CheckPair(x, y);
  CheckPeak(peak);
  const double c1 = (0.01 * peak) * (0.01 * peak);
  const double c2 = (0.03 * peak) * (0.03 * peak);
  double sum = 0.0;
  for (int c = 0; c < x.channels; ++c) {
    sum += SsimSum(x.Plane(c), y.Plane(c), x.width, x.height, c1, c2);
  }
  return sum / static_cast<double>(x.data.size());
}

double AbRmse(const Image& lab_x, const Image& lab_y) {
  CheckPair(lab_x, lab_y);
  if (lab_x.channels != 3) {
    throw InvalidArgument("ab-RMSE needs Lab images of 3 channels, got {}", Shape(lab_x));
  }
  double sum = 0.0;
  const size_t n = lab_x.PlaneSize();
  for (size_t i = n; i < 3 * n; ++i) {
    const double d = static_cast<double>(lab_x.data[i]) - lab_y.data[i];
    sum += d * d;
  }
  return std::sqrt(sum / (2.0 * static_cast<double>(n)));
}

}  // namespace color3d
