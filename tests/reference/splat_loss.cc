#include <array>
#include <cmath>

#include "tests/reference/splat.h"

namespace color3d {
namespace {

// 11x11 Gaussian window, sigma 1.5, of sum 1.
std::array<double, 121> MakeWindow() {
  std::array<double, 121> window;
  double norm = 0.0;
  for (int k = 0; k < 121; ++k) {
    const int dx = k % 11 - 5, dy = k / 11 - 5;
    window[k] = std::exp(-(dx * dx + dy * dy) / (2.0 * 1.5 * 1.5));
    norm += window[k];
  }
  for (double& w : window) w /= norm;
  return window;
}

// Zeros outside of the picture.
double Blurred(const std::vector<double>& p, int width, int height, int x, int y) {
  static const std::array<double, 121> window = MakeWindow();
  double sum = 0.0;
  for (int k = 0; k < 121; ++k) {
    const int xx = x + k % 11 - 5, yy = y + k / 11 - 5;
    if (xx < 0 || yy < 0 || xx >= width || yy >= height) continue;
    sum += window[k] * p[static_cast<size_t>(yy) * width + xx];
  }
  return sum;
}

std::vector<double> Product(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> p(a.size());
  for (size_t i = 0; i < a.size(); ++i) p[i] = a[i] * b[i];
  return p;
}

double DissimilaritySum(const std::vector<double>& x,
                        const std::vector<double>& y,
                        const std::vector<double>& weight,
                        int width,
                        int height) {
  const std::vector<double> xx = Product(x, x), xy = Product(x, y), yy = Product(y, y);
  double sum = 0.0;
  for (int r = 0; r < height; ++r) {
    for (int c = 0; c < width; ++c) {
      const double mx = Blurred(x, width, height, c, r), my = Blurred(y, width, height, c, r);
      const double sx = Blurred(xx, width, height, c, r) - mx * mx;
      const double sy = Blurred(yy, width, height, c, r) - my * my;
      const double sxy = Blurred(xy, width, height, c, r) - mx * my;
      const double ssim = (2 * mx * my + kSsimC1) * (2 * sxy + kSsimC2) /
                          ((mx * mx + my * my + kSsimC1) * (sx + sy + kSsimC2));
      const size_t i = static_cast<size_t>(r) * width + c;
      sum += (weight.empty() ? 1.0 : weight[i]) * (1.0 - ssim);
    }
  }
  return sum;
}

double EdgeMean(const std::vector<double>& x,
                const std::vector<double>& y,
                const std::vector<double>& weight,
                int width,
                int height) {
  if (width < 3 || height < 3) return 0.0;
  double sum = 0.0;
  for (int r = 1; r < height - 1; ++r) {
    for (int c = 1; c < width - 1; ++c) {
      const size_t i = static_cast<size_t>(r) * width + c;
      const auto laplacian = [&](const std::vector<double>& p) {
        return p[i - 1] + p[i + 1] + p[i - width] + p[i + width] - 4.0 * p[i];
      };
      const double d = laplacian(x) - laplacian(y);
      sum += (weight.empty() ? 1.0 : weight[i]) *
             std::sqrt(d * d + double{kCharbonnierEpsilon} * kCharbonnierEpsilon);
    }
  }
  return sum / (static_cast<double>(width - 2) * (height - 2));
}

}  // namespace

double ReferenceLoss(const std::vector<std::vector<double>>& x,
                     const std::vector<std::vector<double>>& y,
                     const std::vector<double>& weight,
                     int width,
                     int height,
                     const LossWeights& weights) {
  const double pixels = static_cast<double>(width) * height;
  double loss = 0.0;
  for (size_t c = 0; c < x.size(); ++c) {
    double l1 = 0.0;
    for (size_t i = 0; i < x[c].size(); ++i) {
      l1 += (weight.empty() ? 1.0 : weight[i]) * std::abs(x[c][i] - y[c][i]);
    }
    loss += weights.l1 * l1 / pixels;
    loss += weights.ssim * DissimilaritySum(x[c], y[c], weight, width, height) / pixels;
    loss += weights.edge * EdgeMean(x[c], y[c], weight, width, height);
  }
  return loss / static_cast<double>(x.size());
}

}  // namespace color3d
