#include "core/color/lab.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>

#include "core/base/error.h"
#include "core/base/parallel.h"

namespace color3d {
namespace {

// IEC 61966-2-1 primaries with the D65 white of the same standard, linear RGB -> XYZ. The white
// point is the row sum, so that R = G = B is neutral to the last bit.
constexpr double kXyzFromRgb[3][3] = {{0.4124564, 0.3575761, 0.1804375},
                                      {0.2126729, 0.7151522, 0.0721750},
                                      {0.0193339, 0.1191920, 0.9503041}};
constexpr double kWhiteX = 0.4124564 + 0.3575761 + 0.1804375;
constexpr double kWhiteY = 0.2126729 + 0.7151522 + 0.0721750;
constexpr double kWhiteZ = 0.0193339 + 0.1191920 + 0.9503041;

// CIE 15:2004 in exact fractions: f(t) is t^(1/3) above kEpsilon, linear below.
constexpr double kEpsilon = 216.0 / 24389.0;
constexpr double kKappa = 24389.0 / 27.0;
constexpr double kDelta = 6.0 / 29.0;  // kEpsilon^(1/3)

constexpr double kDecodeKnee = 0.04045;
constexpr double kEncodeKnee = 0.0031308;

// Inverse of kXyzFromRgb by cofactors, at compile time.
struct Matrix3 {
  double m[3][3];
};
constexpr Matrix3 Inverse(const double (&a)[3][3]) {
  Matrix3 out{};
  double determinant = 0.0;
  for (int j = 0; j < 3; ++j) {
    determinant +=
        a[0][j] * (a[1][(j + 1) % 3] * a[2][(j + 2) % 3] - a[1][(j + 2) % 3] * a[2][(j + 1) % 3]);
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      out.m[j][i] = (a[(i + 1) % 3][(j + 1) % 3] * a[(i + 2) % 3][(j + 2) % 3] -
                     a[(i + 1) % 3][(j + 2) % 3] * a[(i + 2) % 3][(j + 1) % 3]) /
                    determinant;
    }
  }
  return out;
}
constexpr Matrix3 kRgbFromXyz = Inverse(kXyzFromRgb);

// The n-th root of a positive, normal x: an exponent-dividing guess (within a few per cent), then
// two Halley steps, which triple the digits each. About 1e-11 relative, several times faster than
// std::pow, and the same on every machine.
template <int n>
double PositiveRoot(double x) {
  constexpr uint64_t kOne = 0x3FF0000000000000ULL;
  double y = std::bit_cast<double>(std::bit_cast<uint64_t>(x) / n + kOne / n * (n - 1));
  for (int i = 0; i < 2; ++i) {
    double power = y * y;
    if constexpr (n == 3) power = power * y;
    if constexpr (n == 5) power = power * power * y;
    y *= ((n - 1) * power + (n + 1) * x) / ((n + 1) * power + (n - 1) * x);
  }
  return y;
}

// The two families differ only in how roots are taken: Exact uses the C library (the float64
// reference), Fast the roots above (whole images).
struct Exact {
  static double Cbrt(double x) { return std::cbrt(x); }
  static double Pow2p4(double x) { return std::pow(x, 2.4); }
  static double Pow1Over2p4(double x) { return std::pow(x, 1.0 / 2.4); }
};
struct Fast {
  static double Cbrt(double x) { return PositiveRoot<3>(x); }
  static double Pow2p4(double x) {
    const double root = PositiveRoot<5>(x);
    return x * x * root * root;
  }
  // x^(5/12) = (x * x^(1/4))^(1/3).
  static double Pow1Over2p4(double x) { return PositiveRoot<3>(x * std::sqrt(std::sqrt(x))); }
};

// Both transfer functions are continued as odd functions below zero, so that out-of-gamut colours
// survive a round trip.
template <typename Roots>
double LinearFromSrgb(double v) {
  const double m = std::abs(v);
  const double linear = m <= kDecodeKnee ? m / 12.92 : Roots::Pow2p4((m + 0.055) / 1.055);
  return std::copysign(linear, v);
}
template <typename Roots>
double SrgbFromLinear(double v) {
  const double m = std::abs(v);
  const double encoded = m <= kEncodeKnee ? 12.92 * m : 1.055 * Roots::Pow1Over2p4(m) - 0.055;
  return std::copysign(encoded, v);
}

template <typename Roots>
double F(double t) {
  return t > kEpsilon ? Roots::Cbrt(t) : (kKappa * t + 16.0) / 116.0;
}
double InverseF(double f) { return f > kDelta ? f * f * f : (116.0 * f - 16.0) / kKappa; }

template <typename Roots>
LabColor LabFromSrgbWith(const RgbColor& srgb) {
  const double r = LinearFromSrgb<Roots>(srgb.r);
  const double g = LinearFromSrgb<Roots>(srgb.g);
  const double b = LinearFromSrgb<Roots>(srgb.b);
  const auto& m = kXyzFromRgb;
  const double fx = F<Roots>((m[0][0] * r + m[0][1] * g + m[0][2] * b) / kWhiteX);
  const double fy = F<Roots>((m[1][0] * r + m[1][1] * g + m[1][2] * b) / kWhiteY);
  const double fz = F<Roots>((m[2][0] * r + m[2][1] * g + m[2][2] * b) / kWhiteZ);
  return {116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)};
}

RgbColor LinearFromLab(const LabColor& lab) {
  const double fy = (lab.l + 16.0) / 116.0;
  const double x = kWhiteX * InverseF(fy + lab.a / 500.0);
  const double y = kWhiteY * InverseF(fy);
  const double z = kWhiteZ * InverseF(fy - lab.b / 200.0);
  const auto& m = kRgbFromXyz.m;
  return {m[0][0] * x + m[0][1] * y + m[0][2] * z,
          m[1][0] * x + m[1][1] * y + m[1][2] * z,
          m[2][0] * x + m[2][1] * y + m[2][2] * z};
}

// Linear units; far below a step of 16 bits.
constexpr double kGamutSlack = 1e-9;

// At constant lightness and hue the sRGB gamut is star-shaped about the neutral axis with one
// exception: just inside its bright yellow edge (L 91..99) red rises to 1.0304 linear, 1.013
// encoded. Reducing chroma strictly would throw a yellow that just misses the edge to half its
// chroma. There red alone may go this far and is cut afterwards, which moves a colour by at most
// 0.84 CIEDE2000 and makes the mapping continuous everywhere.
double RedLimit(double l) {
  constexpr double kDepth = 0.0305;  // of the dent, over 96..97.25
  const double rise = (l - 90.5) / (96.0 - 90.5);
  const double fall = (100.0 - l) / (100.0 - 97.25);
  return 1.0 + kDepth * std::clamp(std::min(rise, fall), 0.0, 1.0);
}

// Distance of the worst linear channel from the gamut; <= 0 inside.
double Excess(const RgbColor& v, double red_limit) {
  const double low = std::min({v.r, v.g, v.b});
  const double high = std::max({v.r - red_limit, v.g - 1.0, v.b - 1.0});
  return std::max(high, -low) - kGamutSlack;
}

// The largest scale of (a, b) that fits, found by the Illinois variant of false position: the
// low end of the bracket is always inside the gamut and is returned.
RgbColor LinearInGamut(LabColor lab) {
  lab.l = std::clamp(lab.l, 0.0, 100.0);
  const double red_limit = RedLimit(lab.l);
  const RgbColor outside = LinearFromLab(lab);
  double high_excess = Excess(outside, red_limit);
  if (high_excess <= 0.0) return outside;
  double low = 0.0;
  double high = 1.0;
  RgbColor inside = LinearFromLab({lab.l, 0.0, 0.0});
  double low_excess = std::min(Excess(inside, red_limit), -1e-12);
  int side = 0;
  for (int i = 0; i < 60 && high - low > 1e-7; ++i) {
    double t = (low * high_excess - high * low_excess) / (high_excess - low_excess);
    // False position can creep along a flat excess; every fourth step halves the bracket.
    if (i % 4 == 3) t = 0.5 * (low + high);
    const RgbColor middle = LinearFromLab({lab.l, t * lab.a, t * lab.b});
    const double excess = Excess(middle, red_limit);
    if (excess <= 0.0) {
      low = t;
      low_excess = std::min(excess, -1e-15);
      inside = middle;
      if (side == -1) high_excess *= 0.5;
      side = -1;
    } else {
      high = t;
      high_excess = excess;
      if (side == 1) low_excess *= 0.5;
      side = 1;
    }
  }
  return inside;
}

template <typename Roots>
RgbColor EncodeClamped(const RgbColor& linear) {
  return {SrgbFromLinear<Roots>(std::clamp(linear.r, 0.0, 1.0)),
          SrgbFromLinear<Roots>(std::clamp(linear.g, 0.0, 1.0)),
          SrgbFromLinear<Roots>(std::clamp(linear.b, 0.0, 1.0))};
}

template <typename Roots>
double LuminanceFromGrayWith(double gray) {
  return 116.0 * F<Roots>(LinearFromSrgb<Roots>(gray)) - 16.0;
}
template <typename Roots>
double GrayFromLuminanceWith(double luminance) {
  return SrgbFromLinear<Roots>(InverseF((luminance + 16.0) / 116.0));
}

[[noreturn]] void ThrowChannels(const Image& image, const std::string& wanted) {
  throw InvalidArgument("the image has {} channels; {}", image.channels, wanted);
}

Image EmptySrgbFor(const Image& lab) {
  if (lab.channels != 1 && lab.channels != 3) ThrowChannels(lab, "sRGB needs 3 (Lab) or 1 (L)");
  return Image(lab.width, lab.height, 3);
}

// Converts the pixels [begin, end).
void ConvertPixels(const Image& lab, size_t begin, size_t end, Image* srgb) {
  const size_t n = lab.PlaneSize();
  if (lab.channels == 1) {
    for (size_t i = begin; i < end; ++i) {
      const double l = std::clamp<double>(lab.data[i], 0.0, 100.0);
      const float gray = static_cast<float>(std::min(GrayFromLuminanceWith<Fast>(l), 1.0));
      srgb->data[i] = srgb->data[n + i] = srgb->data[2 * n + i] = gray;
    }
    return;
  }
  for (size_t i = begin; i < end; ++i) {
    const RgbColor c =
        EncodeClamped<Fast>(LinearInGamut({lab.data[i], lab.data[n + i], lab.data[2 * n + i]}));
    srgb->data[i] = static_cast<float>(std::min(c.r, 1.0));
    srgb->data[n + i] = static_cast<float>(std::min(c.g, 1.0));
    srgb->data[2 * n + i] = static_cast<float>(std::min(c.b, 1.0));
  }
}

}  // namespace

LabColor LabFromSrgb(const RgbColor& srgb) { return LabFromSrgbWith<Exact>(srgb); }

RgbColor SrgbFromLabUnclamped(const LabColor& lab) {
  const RgbColor linear = LinearFromLab(lab);
  return {SrgbFromLinear<Exact>(linear.r),
          SrgbFromLinear<Exact>(linear.g),
          SrgbFromLinear<Exact>(linear.b)};
}

RgbColor SrgbFromLab(const LabColor& lab) { return EncodeClamped<Exact>(LinearInGamut(lab)); }

double LuminanceFromGray(double gray) { return LuminanceFromGrayWith<Exact>(gray); }
double GrayFromLuminance(double luminance) { return GrayFromLuminanceWith<Exact>(luminance); }

Image LabFromSrgb(const Image& srgb) {
  if (srgb.channels == 1) return LuminanceFromSrgb(srgb);
  if (srgb.channels != 3) ThrowChannels(srgb, "Lab needs 3 (sRGB) or 1 (grey)");
  Image lab(srgb.width, srgb.height, 3);
  const size_t n = srgb.PlaneSize();
  for (size_t i = 0; i < n; ++i) {
    const LabColor c =
        LabFromSrgbWith<Fast>({srgb.data[i], srgb.data[n + i], srgb.data[2 * n + i]});
    lab.data[i] = static_cast<float>(c.l);
    lab.data[n + i] = static_cast<float>(c.a);
    lab.data[2 * n + i] = static_cast<float>(c.b);
  }
  return lab;
}

Image LuminanceFromSrgb(const Image& image) {
  if (image.channels != 1 && image.channels != 3) {
    ThrowChannels(image, "luminance needs 3 (sRGB) or 1 (grey)");
  }
  Image luminance(image.width, image.height, 1);
  const size_t n = image.PlaneSize();
  if (image.channels == 1) {
    for (size_t i = 0; i < n; ++i) {
      luminance.data[i] = static_cast<float>(LuminanceFromGrayWith<Fast>(image.data[i]));
    }
    return luminance;
  }
  const auto& row = kXyzFromRgb[1];
  for (size_t i = 0; i < n; ++i) {
    const double y = row[0] * LinearFromSrgb<Fast>(image.data[i]) +
                     row[1] * LinearFromSrgb<Fast>(image.data[n + i]) +
                     row[2] * LinearFromSrgb<Fast>(image.data[2 * n + i]);
    luminance.data[i] = static_cast<float>(116.0 * F<Fast>(y / kWhiteY) - 16.0);
  }
  return luminance;
}

Image SrgbFromLab(const Image& lab) {
  Image srgb = EmptySrgbFor(lab);
  ConvertPixels(lab, 0, lab.PlaneSize(), &srgb);
  return srgb;
}

Image SrgbFromLab(const Image& lab, ThreadPool& pool) {
  Image srgb = EmptySrgbFor(lab);
  pool.ForRanges(static_cast<int64_t>(lab.PlaneSize()), [&](int64_t begin, int64_t end, int) {
    ConvertPixels(lab, static_cast<size_t>(begin), static_cast<size_t>(end), &srgb);
  });
  return srgb;
}

Image JoinLab(const Image& luminance, const Image& ab) {
  if (luminance.channels != 1) ThrowChannels(luminance, "JoinLab needs 1 (L) first");
  if (ab.channels != 2) ThrowChannels(ab, "JoinLab needs 2 (a, b) second");
  if (luminance.width != ab.width || luminance.height != ab.height) {
    throw InvalidArgument("luminance is {} x {} px but ab is {} x {} px",
                          luminance.width,
                          luminance.height,
                          ab.width,
                          ab.height);
  }
  Image lab;
  lab.width = ab.width;
  lab.height = ab.height;
  lab.channels = 3;
  lab.data.reserve(luminance.data.size() + ab.data.size());
  lab.data.insert(lab.data.end(), luminance.data.begin(), luminance.data.end());
  lab.data.insert(lab.data.end(), ab.data.begin(), ab.data.end());
  return lab;
}

}  // namespace color3d
