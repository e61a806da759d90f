#include "core/color/lab.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/base/random.h"
#include "core/color/difference.h"

namespace color3d {
namespace {

double Worst(const LabColor& x, double l, double a, double b) {
  return std::max({std::abs(x.l - l), std::abs(x.a - a), std::abs(x.b - b)});
}

TEST(Lab, MatchesKnownColors) {
  // Lindbloom's calculator, sRGB D65.
  const LabColor red = LabFromSrgb(RgbColor{1, 0, 0});
  EXPECT_LT(Worst(red, 53.2408, 80.0925, 67.2032), 2e-3);
  const LabColor blue = LabFromSrgb(RgbColor{0, 0, 1});
  EXPECT_LT(Worst(blue, 32.2970, 79.1875, -107.8602), 2e-3);
  const LabColor white = LabFromSrgb(RgbColor{1, 1, 1});
  EXPECT_LT(Worst(white, 100.0, 0.0, 0.0), 1e-9);
  EXPECT_NEAR(LuminanceFromGray(0.5), 53.3890, 1e-3);
}

TEST(Lab, GraysAreNeutralAndMonotone) {
  double previous = -1.0;
  for (int i = 0; i <= 1000; ++i) {
    const double g = i / 1000.0;
    const LabColor c = LabFromSrgb(RgbColor{g, g, g});
    EXPECT_LT(Worst(c, LuminanceFromGray(g), 0.0, 0.0), 1e-9);
    EXPECT_GT(c.l, previous);
    previous = c.l;
    EXPECT_NEAR(GrayFromLuminance(c.l), g, 2e-7);  // the sRGB knee has a step of 1e-7 or so
  }
}

TEST(Lab, ImagePathAgreesWithFloat64) {
  // A lattice of 65^3, random colours, and the dark corner, where the functions are most curved.
  const int n = 65;
  Image srgb(n * n, n + 40, 3);
  Random random(1);
  for (int y = 0; y < srgb.height; ++y) {
    for (int x = 0; x < srgb.width; ++x) {
      if (y < n) {
        srgb.At(0, y, x) = static_cast<float>(y) / (n - 1);
        srgb.At(1, y, x) = static_cast<float>(x / n) / (n - 1);
        srgb.At(2, y, x) = static_cast<float>(x % n) / (n - 1);
      } else {
        const double top = y < n + 20 ? 1.0 : 0.1;
        for (int c = 0; c < 3; ++c) {
          srgb.At(c, y, x) = static_cast<float>(random.NextUniform(0, top));
        }
      }
    }
  }
  const Image lab = LabFromSrgb(srgb);
  const Image luminance = LuminanceFromSrgb(srgb);
  const Image back = SrgbFromLab(lab);
  double worst_lab = 0.0, worst_l = 0.0, worst_back = 0.0;
  for (int y = 0; y < srgb.height; ++y) {
    for (int x = 0; x < srgb.width; ++x) {
      const RgbColor c{srgb.At(0, y, x), srgb.At(1, y, x), srgb.At(2, y, x)};
      const LabColor reference = LabFromSrgb(c);
      worst_lab =
          std::max(worst_lab, Worst(reference, lab.At(0, y, x), lab.At(1, y, x), lab.At(2, y, x)));
      worst_l = std::max(worst_l, std::abs(reference.l - luminance.At(0, y, x)));
      worst_back = std::max({worst_back,
                             std::abs(c.r - back.At(0, y, x)),
                             std::abs(c.g - back.At(1, y, x)),
                             std::abs(c.b - back.At(2, y, x))});
    }
  }
  EXPECT_LT(worst_lab, 1e-4);
  EXPECT_LT(worst_l, 1e-4);
  EXPECT_LT(worst_back, 2e-5);  // float Lab rounds to 4e-6, times the steepest slope of sRGB
  RecordProperty("worst_lab_1e9", static_cast<int>(worst_lab * 1e9));
}

TEST(Lab, OutOfGamutColorsRoundTrip) {
  Random random(2);
  for (int i = 0; i < 2000; ++i) {
    const LabColor lab{
        random.NextUniform(0, 100), random.NextUniform(-128, 127), random.NextUniform(-128, 127)};
    const LabColor again = LabFromSrgb(SrgbFromLabUnclamped(lab));
    EXPECT_LT(Worst(again, lab.l, lab.a, lab.b), 2e-3) << lab.l << " " << lab.a << " " << lab.b;
  }
}

bool Fits(const RgbColor& c) {
  return std::min({c.r, c.g, c.b}) >= 0 && std::max({c.r, c.g, c.b}) <= 1;
}

TEST(Lab, GamutMappingKeepsLightnessAndHue) {
  Random random(4);
  int mapped = 0, strict = 0;
  for (int i = 0; i < 20000; ++i) {
    const LabColor lab{
        random.NextUniform(0, 100), random.NextUniform(-128, 127), random.NextUniform(-128, 127)};
    const RgbColor srgb = SrgbFromLab(lab);
    for (double v : {srgb.r, srgb.g, srgb.b}) {
      ASSERT_GE(v, 0.0);
      ASSERT_LE(v, 1.0);
    }
    const LabColor got = LabFromSrgb(srgb);
    const double wanted = std::hypot(lab.a, lab.b);
    const double chroma = std::hypot(got.a, got.b);
    EXPECT_LE(chroma, wanted + 1.5);
    const RgbColor raw = SrgbFromLabUnclamped(lab);
    if (Fits(raw)) {
      EXPECT_NEAR(chroma, wanted, 1e-3);
      continue;
    }
    ++mapped;
    // Only the last 1.3 % of red of bright colours is clipped; otherwise lightness and hue are
    // kept.
    const bool red_clipped = lab.l > 90.0 && srgb.r > 1.0 - 1e-9;
    strict += red_clipped ? 0 : 1;
    EXPECT_NEAR(got.l, lab.l, red_clipped ? 0.45 : 1e-3);
    // Distance of (a, b) from the ray of constant hue.
    const double off_ray = std::abs(got.a * lab.b - got.b * lab.a) / wanted;
    EXPECT_LT(off_ray, red_clipped ? 2.0 : 2e-3);
    // The chroma is maximal: 0.1 % more does not fit.
    if (chroma > 1.0 && !red_clipped) {
      const double more = 1.001 * chroma / wanted;
      EXPECT_FALSE(Fits(SrgbFromLabUnclamped({lab.l, more * lab.a, more * lab.b})));
    }
  }
  EXPECT_GT(mapped, 5000);
  EXPECT_GT(strict, 4000);
}

TEST(Lab, GamutMappingIsContinuousAtYellow) {
  // Just outside the gamut's surface, everywhere: strict chroma reduction fails this by up to 30
  // units at bright yellow, where the gamut is not star-shaped.
  Random random(7);
  double worst = 0.0;
  for (int i = 0; i < 40000; ++i) {
    double v[3];
    for (double& c : v) c = random.NextUniform();
    v[i % 3] = (i / 3) % 2;
    if (i % 4 == 0) v[1] = random.NextUniform(0.9, 1.0);  // more yellows
    const LabColor on = LabFromSrgb(RgbColor{v[0], v[1], v[2]});
    const LabColor off{on.l + random.NextUniform(-1e-3, 1e-3),
                       on.a + random.NextUniform(-0.1, 0.1),
                       on.b + random.NextUniform(-0.1, 0.1)};
    const LabColor got = LabFromSrgb(SrgbFromLab(off));
    worst = std::max(worst, DeltaE00(got, on));
  }
  EXPECT_LT(worst, 1.2);
}

TEST(Lab, ClampsLightnessToBlackAndWhite) {
  for (const LabColor& lab : {LabColor{-5, 30, 30}, LabColor{0, 50, -20}}) {
    const RgbColor c = SrgbFromLab(lab);
    EXPECT_LT(std::max({c.r, c.g, c.b}), 1e-6);
  }
  for (const LabColor& lab : {LabColor{105, 30, 30}, LabColor{100, 50, -20}}) {
    const RgbColor c = SrgbFromLab(lab);
    EXPECT_GT(std::min({c.r, c.g, c.b}), 1 - 1e-6);
  }
}

TEST(Lab, ImageGamutMappingAgreesWithScalar) {
  Random random(5);
  Image lab(100, 100, 3);
  for (size_t i = 0; i < lab.PlaneSize(); ++i) {
    lab.Plane(0)[i] = static_cast<float>(random.NextUniform(-2, 102));
    lab.Plane(1)[i] = static_cast<float>(random.NextUniform(-128, 127));
    lab.Plane(2)[i] = static_cast<float>(random.NextUniform(-128, 127));
  }
  const Image srgb = SrgbFromLab(lab);
  for (size_t i = 0; i < lab.PlaneSize(); ++i) {
    const RgbColor c = SrgbFromLab(LabColor{lab.Plane(0)[i], lab.Plane(1)[i], lab.Plane(2)[i]});
    EXPECT_NEAR(srgb.Plane(0)[i], c.r, 1e-6);
    EXPECT_NEAR(srgb.Plane(1)[i], c.g, 1e-6);
    EXPECT_NEAR(srgb.Plane(2)[i], c.b, 1e-6);
  }
}

TEST(Lab, ThreadsGiveTheSameImage) {
  ThreadPool pool(3);
  for (const int channels : {1, 3}) {
    Image lab(17, 5, channels);
    for (size_t i = 0; i < lab.data.size(); ++i) lab.data[i] = static_cast<float>(i % 97);
    EXPECT_EQ(SrgbFromLab(lab, pool).data, SrgbFromLab(lab).data);
  }
  EXPECT_THROW(SrgbFromLab(Image(4, 4, 2), pool), Error);
}

TEST(Lab, OneChannelIsLuminance) {
  Image gray(256, 1, 1);
  for (int x = 0; x < 256; ++x) gray.At(0, 0, x) = x / 255.0f;
  const Image luminance = LabFromSrgb(gray);
  ASSERT_EQ(luminance.channels, 1);
  const Image back = SrgbFromLab(luminance);
  ASSERT_EQ(back.channels, 3);
  for (int x = 0; x < 256; ++x) {
    EXPECT_NEAR(luminance.At(0, 0, x), LuminanceFromGray(gray.At(0, 0, x)), 1e-5);
    EXPECT_NEAR(back.At(0, 0, x), gray.At(0, 0, x), 1e-6);
    EXPECT_EQ(back.At(0, 0, x), back.At(2, 0, x));
  }
}

TEST(Lab, JoinLabRejectsWrongShapes) {
  const Image lab = JoinLab(Image(2, 2, 1, 50.0f), Image(2, 2, 2, 7.0f));
  EXPECT_EQ(lab.channels, 3);
  EXPECT_EQ(lab.At(0, 1, 1), 50.0f);
  EXPECT_EQ(lab.At(2, 1, 1), 7.0f);
  EXPECT_THROW(JoinLab(Image(2, 2, 1), Image(2, 3, 2)), Error);
  EXPECT_THROW(JoinLab(Image(2, 2, 3), Image(2, 2, 2)), Error);
  EXPECT_THROW(LabFromSrgb(Image(2, 2, 2)), Error);
  EXPECT_THROW(LuminanceFromSrgb(Image(2, 2, 4)), Error);
  EXPECT_THROW(SrgbFromLab(Image(2, 2, 2)), Error);
}

TEST(Lab, ConvertsMegapixelWellBelowOneSecond) {
  Random random(6);
  Image lab(1000, 1000, 3);
  for (size_t i = 0; i < lab.PlaneSize(); ++i) {
    lab.Plane(0)[i] = static_cast<float>(random.NextUniform(0, 100));
    lab.Plane(1)[i] = static_cast<float>(random.NextUniform(-128, 127));
    lab.Plane(2)[i] = static_cast<float>(random.NextUniform(-128, 127));
  }
  const auto start = std::chrono::steady_clock::now();
  const Image srgb = SrgbFromLab(lab);  // mostly out of gamut: the slow case
  const auto middle = std::chrono::steady_clock::now();
  const Image again = LabFromSrgb(srgb);
  const auto end = std::chrono::steady_clock::now();
  const double to_srgb = std::chrono::duration<double>(middle - start).count();
  const double to_lab = std::chrono::duration<double>(end - middle).count();
  RecordProperty("to_srgb_ms", static_cast<int>(1e3 * to_srgb));
  RecordProperty("to_lab_ms", static_cast<int>(1e3 * to_lab));
  // Generous: other work may share the machine. Alone: about 0.3 s and 0.1 s.
  EXPECT_LT(to_srgb, 3.0);
  EXPECT_LT(to_lab, 1.5);
  EXPECT_EQ(again.channels, 3);
}

}  // namespace
}  // namespace color3d
