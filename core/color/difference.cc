#include "core/color/difference.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180.0;

// Hue angle in [0, 2 pi); 0 for a neutral colour (Sharma et al. 2005, equation 7).
double Hue(double a, double b) {
  if (a == 0.0 && b == 0.0) return 0.0;
  const double h = std::atan2(b, a);
  return h < 0.0 ? h + 2.0 * kPi : h;
}

double Pow7(double x) {
  const double x2 = x * x;
  return x2 * x2 * x2 * x;
}

// sqrt(C^7 / (C^7 + 25^7)).
double ChromaWeight(double chroma) {
  const double c7 = Pow7(chroma);
  return std::sqrt(c7 / (c7 + 6103515625.0));
}

}  // namespace

double DeltaE00(const LabColor& x, const LabColor& y) {
  // Step 1, equations 2-7.
  const double mean_c = 0.5 * (std::hypot(x.a, x.b) + std::hypot(y.a, y.b));
  const double g = 0.5 * (1.0 - ChromaWeight(mean_c));
  const double a1 = (1.0 + g) * x.a;
  const double a2 = (1.0 + g) * y.a;
  const double c1 = std::hypot(a1, x.b);
  const double c2 = std::hypot(a2, y.b);
  const double h1 = Hue(a1, x.b);
  const double h2 = Hue(a2, y.b);
  // Step 2, equations 8-11.
  const bool neutral = c1 * c2 == 0.0;
  double dh = neutral ? 0.0 : h2 - h1;
  if (dh > kPi) dh -= 2.0 * kPi;
  if (dh < -kPi) dh += 2.0 * kPi;
  const double delta_l = y.l - x.l;
  const double delta_c = c2 - c1;
  const double delta_h = 2.0 * std::sqrt(c1 * c2) * std::sin(0.5 * dh);
  // Step 3, equations 12-22.
  const double mean_l = 0.5 * (x.l + y.l);
  const double mean_c_prime = 0.5 * (c1 + c2);
  double mean_h = h1 + h2;
  if (!neutral) {
    if (std::abs(h1 - h2) > kPi) mean_h += mean_h < 2.0 * kPi ? 2.0 * kPi : -2.0 * kPi;
    mean_h *= 0.5;
  }
  const double t = 1.0 - 0.17 * std::cos(mean_h - 30.0 * kDegree) + 0.24 * std::cos(2.0 * mean_h) +
                   0.32 * std::cos(3.0 * mean_h + 6.0 * kDegree) -
                   0.20 * std::cos(4.0 * mean_h - 63.0 * kDegree);
  const double bump = (mean_h / kDegree - 275.0) / 25.0;
  const double delta_theta = 30.0 * kDegree * std::exp(-bump * bump);
  const double l50 = (mean_l - 50.0) * (mean_l - 50.0);
  const double s_l = 1.0 + 0.015 * l50 / std::sqrt(20.0 + l50);
  const double s_c = 1.0 + 0.045 * mean_c_prime;
  const double s_h = 1.0 + 0.015 * mean_c_prime * t;
  const double r_t = -std::sin(2.0 * delta_theta) * 2.0 * ChromaWeight(mean_c_prime);
  const double l_term = delta_l / s_l;
  const double c_term = delta_c / s_c;
  const double h_term = delta_h / s_h;
  // R_T can make the form slightly negative in exact cancellation only.
  return std::sqrt(
      std::max(0.0, l_term * l_term + c_term * c_term + h_term * h_term + r_t * c_term * h_term));
}

double MeanDeltaE00(const Image& lab_x, const Image& lab_y) {
  if (lab_x.channels != 3 || lab_y.channels != 3 || lab_x.width != lab_y.width ||
      lab_x.height != lab_y.height || lab_x.Empty()) {
    throw InvalidArgument(
        "colour difference needs two Lab images of one size, got {} x {} x {} and {} x {} x {}",
        lab_x.width,
        lab_x.height,
        lab_x.channels,
        lab_y.width,
        lab_y.height,
        lab_y.channels);
  }
  const size_t n = lab_x.PlaneSize();
  const float* p = lab_x.data.data();
  const float* q = lab_y.data.data();
  double sum = 0.0;
  for (size_t i = 0; i < n; ++i) {
    sum += DeltaE00({p[i], p[n + i], p[2 * n + i]}, {q[i], q[n + i], q[2 * n + i]});
  }
  return sum / static_cast<double>(n);
}

namespace {

// `absolute`: of the magnitudes of the opponent channels.
double ColorfulnessOf(const Image& srgb, bool absolute) {
  if (srgb.channels != 3 || srgb.Empty()) {
    throw InvalidArgument("colourfulness needs a 3-channel sRGB image, got {} channels",
                          srgb.channels);
  }
  const size_t n = srgb.PlaneSize();
  double sum_rg = 0.0, sum_yb = 0.0, sum_rg2 = 0.0, sum_yb2 = 0.0;
  for (size_t i = 0; i < n; ++i) {
    const double r = 255.0 * srgb.data[i];
    const double g = 255.0 * srgb.data[n + i];
    const double b = 255.0 * srgb.data[2 * n + i];
    const double signed_rg = r - g, signed_yb = 0.5 * (r + g) - b;
    const double rg = absolute ? std::abs(signed_rg) : signed_rg;
    const double yb = absolute ? std::abs(signed_yb) : signed_yb;
    sum_rg += rg;
    sum_yb += yb;
    sum_rg2 += rg * rg;
    sum_yb2 += yb * yb;
  }
  const double mean_rg = sum_rg / n;
  const double mean_yb = sum_yb / n;
  const double variance = std::max(0.0, sum_rg2 / n - mean_rg * mean_rg) +
                          std::max(0.0, sum_yb2 / n - mean_yb * mean_yb);
  return std::sqrt(variance) + 0.3 * std::hypot(mean_rg, mean_yb);
}

}  // namespace

double Colorfulness(const Image& srgb) { return ColorfulnessOf(srgb, /*absolute=*/false); }

double AbsoluteColorfulness(const Image& srgb) { return ColorfulnessOf(srgb, /*absolute=*/true); }

}  // namespace color3d
