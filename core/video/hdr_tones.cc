#include "core/video/hdr_tones.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace color3d {
namespace {

constexpr int kCodes = 65536;
constexpr int kSteps = 4096;  // of the interpolated tables
constexpr double kMostNits = 10000.0;
// Weights of luminance, BT.2020.
constexpr float kRed = 0.2627f, kGreen = 0.6780f, kBlue = 0.0593f;

// SMPTE ST 2084, 5.1 and 5.2.
constexpr double kM1 = 2610.0 / 16384.0, kM2 = 2523.0 / 4096.0 * 128.0;
constexpr double kC1 = 3424.0 / 4096.0, kC2 = 2413.0 / 4096.0 * 32.0, kC3 = 2392.0 / 4096.0 * 32.0;

double SrgbOfLinear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

double LinearOfSrgb(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

// Light of the scene in 0..1 (BT.2100, table 5).
double HlgScene(double value) {
  constexpr double kA = 0.17883277, kB = 0.28466892, kC = 0.55991073;
  return value <= 0.5 ? value * value / 3.0 : (std::exp((value - kC) / kA) + kB) / 12.0;
}

// Interpolates the table at `at` in 0..1.
float Interpolated(const std::vector<float>& table, float at) {
  const float place = std::clamp(at, 0.0f, 1.0f) * kSteps;
  const auto before = std::min(static_cast<size_t>(place), static_cast<size_t>(kSteps - 1));
  const float share = place - static_cast<float>(before);
  return table[before] + share * (table[before + 1] - table[before]);
}

}  // namespace

double PqNits(double value) {
  const double root = std::pow(std::clamp(value, 0.0, 1.0), 1.0 / kM2);
  return kMostNits * std::pow(std::max(root - kC1, 0.0) / (kC2 - kC3 * root), 1.0 / kM1);
}

double PqValue(double nits) {
  const double power = std::pow(std::clamp(nits / kMostNits, 0.0, 1.0), kM1);
  return std::pow((kC1 + kC2 * power) / (1.0 + kC3 * power), kM2);
}

double ToneMappedNits(double nits, double peak_nits) {
  if (peak_nits <= kHdrWhiteNits) return std::clamp(nits, 0.0, kHdrWhiteNits);
  const double peak = PqValue(peak_nits);
  const double white = PqValue(kHdrWhiteNits) / peak;
  const double knee = 1.5 * white - 0.5;
  const double value = std::min(PqValue(nits) / peak, 1.0);
  if (value < knee) return std::max(nits, 0.0);
  const double t = (value - knee) / (1.0 - knee);
  const double t2 = t * t, t3 = t2 * t;
  const double mapped = (2.0 * t3 - 3.0 * t2 + 1.0) * knee + (t3 - 2.0 * t2 + t) * (1.0 - knee) +
                        (3.0 * t2 - 2.0 * t3) * white;
  return PqNits(mapped * peak);
}

HdrTones::HdrTones(FilmTransfer transfer, bool is_wide, double peak_nits)
    : transfer_(transfer), is_wide_(is_wide), light_(kCodes), gain_(kSteps + 1), srgb_(kSteps + 1) {
  for (int i = 0; i < kCodes; ++i) {
    const double value = i / (kCodes - 1.0);
    light_[i] = static_cast<float>(transfer == FilmTransfer::kPq    ? PqNits(value)
                                   : transfer == FilmTransfer::kHlg ? HlgScene(value)
                                                                    : LinearOfSrgb(value));
  }
  const double peak = transfer == FilmTransfer::kPq ? peak_nits : kUsualPeakNits;
  for (int i = 0; i <= kSteps; ++i) {
    const double at = static_cast<double>(i) / kSteps;
    const double nits = kMostNits * at * at * at * at;
    const double mapped = nits > 0.0 ? ToneMappedNits(nits, peak) / nits : 1.0;
    gain_[i] = static_cast<float>(mapped / kHdrWhiteNits);
    srgb_[i] = static_cast<float>(SrgbOfLinear(at * at));
  }
}

void HdrTones::Apply(Image* rgb) const {
  const auto light_of = [&](float value) {
    return light_[static_cast<size_t>(std::lround(std::clamp(value, 0.0f, 1.0f) * (kCodes - 1)))];
  };
  const auto srgb_of = [&](float linear) {
    return Interpolated(srgb_, std::sqrt(std::clamp(linear, 0.0f, 1.0f)));
  };
  float *red = rgb->Plane(0), *green = rgb->Plane(1), *blue = rgb->Plane(2);
  for (size_t i = 0; i < rgb->PlaneSize(); ++i) {
    float r = light_of(red[i]), g = light_of(green[i]), b = light_of(blue[i]);
    if (transfer_ == FilmTransfer::kHlg) {
      // As displayed at 1000 cd/m2 (BT.2100, table 5: gamma 1.2).
      const float scene = kRed * r + kGreen * g + kBlue * b;
      const float display =
          static_cast<float>(kUsualPeakNits) * std::pow(std::max(scene, 0.0f), 0.2f);
      r *= display;
      g *= display;
      b *= display;
    }
    if (transfer_ != FilmTransfer::kUsual) {
      const float brightest = std::max({r, g, b}) / static_cast<float>(kMostNits);
      const float gain = Interpolated(gain_, std::sqrt(std::sqrt(brightest)));
      r *= gain;
      g *= gain;
      b *= gain;
    }
    if (is_wide_) {
      // BT.2087, 2: light of BT.2020's primaries by those of BT.709.
      const float wide_r = r, wide_g = g, wide_b = b;
      r = 1.6605f * wide_r - 0.5877f * wide_g - 0.0728f * wide_b;
      g = -0.1246f * wide_r + 1.1329f * wide_g - 0.0083f * wide_b;
      b = -0.0182f * wide_r - 0.1006f * wide_g + 1.1188f * wide_b;
    }
    red[i] = srgb_of(r);
    green[i] = srgb_of(g);
    blue[i] = srgb_of(b);
  }
}

}  // namespace color3d
