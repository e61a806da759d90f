#include "core/color/quick_srgb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/color/lab.h"

namespace color3d {
namespace {

// Levels of linear light in 0..1, at kSteps + 1 places; interpolated, exact to 0.01 levels.
constexpr int kSteps = 4096;
using Levels = std::array<float, kSteps + 2>;

Levels MakeLevels() {
  Levels levels{};
  for (size_t i = 0; i < levels.size(); ++i) {
    const double v = std::min(1.0, static_cast<double>(i) / kSteps);
    const double encoded = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
    levels[i] = static_cast<float>(255.0 * encoded);
  }
  return levels;
}

// Linear sRGB of the axes of XYZ over the white, from the float64 reference: the conversion is
// linear there.
struct FromXyz {
  std::array<std::array<float, 3>, 3> m;  // by channel
};

double LinearOf(double encoded) {
  const double v = std::abs(encoded);
  const double linear = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  return std::copysign(linear, encoded);
}

FromXyz MakeFromXyz() {
  // Lab of the axes: f(1) = 1, f(0) = 16 / 116.
  constexpr double kOne = 1.0, kNone = 16.0 / 116.0;
  FromXyz made{};
  for (size_t axis = 0; axis < 3; ++axis) {
    const double fx = axis == 0 ? kOne : kNone, fy = axis == 1 ? kOne : kNone,
                 fz = axis == 2 ? kOne : kNone;
    const RgbColor rgb =
        SrgbFromLabUnclamped({116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)});
    made.m[0][axis] = static_cast<float>(LinearOf(rgb.r));
    made.m[1][axis] = static_cast<float>(LinearOf(rgb.g));
    made.m[2][axis] = static_cast<float>(LinearOf(rgb.b));
  }
  return made;
}

float InverseOfF(float f) {
  constexpr float kDelta = 6.0f / 29.0f, kPerKappa = 27.0f / 24389.0f;
  return f > kDelta ? f * f * f : (116.0f * f - 16.0f) * kPerKappa;
}

uint8_t LevelOf(const Levels& levels, float linear) {
  const float at = linear * kSteps;
  const int i = static_cast<int>(at);
  const float share = at - static_cast<float>(i);
  return static_cast<uint8_t>(levels[i] + share * (levels[i + 1] - levels[i]) + 0.5f);
}

}  // namespace

void QuickSrgbFromLab(const float* l, const float* a, const float* b, int64_t count, uint8_t* rgb) {
  static const Levels levels = MakeLevels();
  static const FromXyz from_xyz = MakeFromXyz();
  const auto& m = from_xyz.m;
  std::vector<int64_t> outside;
  for (int64_t i = 0; i < count; ++i) {
    const float fy = (l[i] + 16.0f) * (1.0f / 116.0f);
    const float x = InverseOfF(fy + a[i] * 0.002f), y = InverseOfF(fy),
                z = InverseOfF(fy - b[i] * 0.005f);
    std::array<float, 3> linear{};
    for (size_t c = 0; c < 3; ++c) linear[c] = m[c][0] * x + m[c][1] * y + m[c][2] * z;
    // Rounding must not send white or black to the slow way.
    constexpr float kSlack = 1e-5f;
    const float low = std::min({linear[0], linear[1], linear[2]});
    const float high = std::max({linear[0], linear[1], linear[2]});
    if (!(low >= -kSlack && high <= 1.0f + kSlack)) {
      outside.push_back(i);
      continue;
    }
    for (size_t c = 0; c < 3; ++c) {
      rgb[3 * i + static_cast<int64_t>(c)] = LevelOf(levels, std::clamp(linear[c], 0.0f, 1.0f));
    }
  }
  if (outside.empty()) return;
  Image lab(static_cast<int>(outside.size()), 1, 3);
  for (size_t k = 0; k < outside.size(); ++k) {
    lab.Plane(0)[k] = l[outside[k]];
    lab.Plane(1)[k] = a[outside[k]];
    lab.Plane(2)[k] = b[outside[k]];
  }
  const Image fitted = SrgbFromLab(lab);
  for (size_t k = 0; k < outside.size(); ++k) {
    for (int c = 0; c < 3; ++c) {
      rgb[3 * outside[k] + c] = static_cast<uint8_t>(255.0f * fitted.Plane(c)[k] + 0.5f);
    }
  }
}

}  // namespace color3d
