#include "core/color/difference.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

// Sharma, Wu, Dalal, "The CIEDE2000 color-difference formula: implementation notes, supplementary
// test data, and mathematical observations", 2005, table 1.
struct SharmaPair {
  LabColor x;
  LabColor y;
  double delta_e;
};
constexpr SharmaPair kSharma[34] = {
    {{50.0000, 2.6772, -79.7751}, {50.0000, 0.0000, -82.7485}, 2.0425},
    {{50.0000, 3.1571, -77.2803}, {50.0000, 0.0000, -82.7485}, 2.8615},
    {{50.0000, 2.8361, -74.0200}, {50.0000, 0.0000, -82.7485}, 3.4412},
    {{50.0000, -1.3802, -84.2814}, {50.0000, 0.0000, -82.7485}, 1.0000},
    {{50.0000, -1.1848, -84.8006}, {50.0000, 0.0000, -82.7485}, 1.0000},
    {{50.0000, -0.9009, -85.5211}, {50.0000, 0.0000, -82.7485}, 1.0000},
    {{50.0000, 0.0000, 0.0000}, {50.0000, -1.0000, 2.0000}, 2.3669},
    {{50.0000, -1.0000, 2.0000}, {50.0000, 0.0000, 0.0000}, 2.3669},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0009}, 7.1792},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0010}, 7.1792},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0011}, 7.2195},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0012}, 7.2195},
    {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0009, -2.4900}, 4.8045},
    {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0010, -2.4900}, 4.8045},
    {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0011, -2.4900}, 4.7461},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 0.0000, -2.5000}, 4.3065},
    {{50.0000, 2.5000, 0.0000}, {73.0000, 25.0000, -18.0000}, 27.1492},
    {{50.0000, 2.5000, 0.0000}, {61.0000, -5.0000, 29.0000}, 22.8977},
    {{50.0000, 2.5000, 0.0000}, {56.0000, -27.0000, -3.0000}, 31.9030},
    {{50.0000, 2.5000, 0.0000}, {58.0000, 24.0000, 15.0000}, 19.4535},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 3.1736, 0.5854}, 1.0000},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 3.2972, 0.0000}, 1.0000},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 1.8634, 0.5757}, 1.0000},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 3.2592, 0.3350}, 1.0000},
    {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
    {{63.0109, -31.0961, -5.8663}, {62.8187, -29.7946, -4.0864}, 1.2630},
    {{61.2901, 3.7196, -5.3901}, {61.4292, 2.2480, -4.9620}, 1.8731},
    {{35.0831, -44.1164, 3.7933}, {35.0232, -40.0716, 1.5901}, 1.8645},
    {{22.7233, 20.0904, -46.6940}, {23.0331, 14.9730, -42.5619}, 2.0373},
    {{36.4612, 47.8580, 18.3852}, {36.2715, 50.5065, 21.2231}, 1.4146},
    {{90.8027, -2.0831, 1.4410}, {91.1528, -1.6435, 0.0447}, 1.4441},
    {{90.9257, -0.5406, -0.9208}, {88.6381, -0.8985, -0.7239}, 1.5381},
    {{6.7747, -0.2908, -2.4247}, {5.8714, -0.0985, -2.2286}, 0.6377},
    {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082},
};

TEST(DeltaE00, AgreesWithSharmasTable) {
  for (int i = 0; i < 34; ++i) {
    EXPECT_NEAR(DeltaE00(kSharma[i].x, kSharma[i].y), kSharma[i].delta_e, 5.1e-5)
        << "pair " << i + 1;
    EXPECT_NEAR(DeltaE00(kSharma[i].y, kSharma[i].x), kSharma[i].delta_e, 5.1e-5)
        << "pair " << i + 1;
  }
}

TEST(DeltaE00, IsZeroForEqualColorsAndFiniteAtLimits) {
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const LabColor c{
        random.NextUniform(0, 100), random.NextUniform(-128, 127), random.NextUniform(-128, 127)};
    EXPECT_EQ(DeltaE00(c, c), 0.0);
  }
  EXPECT_TRUE(std::isfinite(DeltaE00({0, 0, 0}, {100, 0, 0})));
  EXPECT_TRUE(std::isfinite(DeltaE00({50, 1e-200, 0}, {50, -1e-200, 0})));
  EXPECT_TRUE(std::isfinite(DeltaE00({50, 1e6, 0}, {50, -1e6, 1e6})));
}

TEST(DeltaE00, AveragesOverImage) {
  Image x(2, 1, 3);
  Image y(2, 1, 3);
  for (int i = 0; i < 2; ++i) {
    const SharmaPair& pair = kSharma[16 + i];
    x.At(0, 0, i) = static_cast<float>(pair.x.l);
    x.At(1, 0, i) = static_cast<float>(pair.x.a);
    x.At(2, 0, i) = static_cast<float>(pair.x.b);
    y.At(0, 0, i) = static_cast<float>(pair.y.l);
    y.At(1, 0, i) = static_cast<float>(pair.y.a);
    y.At(2, 0, i) = static_cast<float>(pair.y.b);
  }
  EXPECT_NEAR(MeanDeltaE00(x, y), 0.5 * (27.1492 + 22.8977), 1e-4);
  EXPECT_THROW(MeanDeltaE00(x, Image(1, 2, 3)), Error);
  EXPECT_THROW(MeanDeltaE00(x, Image(2, 1, 1)), Error);
}

TEST(Colorfulness, MatchesTheFormula) {
  EXPECT_NEAR(Colorfulness(Image(4, 3, 3, 0.4f)), 0.0, 1e-6);
  // Two pixels, pure red and pure blue: rg = 255, 0; yb = 127.5, -255.
  Image image(2, 1, 3);
  image.At(0, 0, 0) = 1.0f;
  image.At(2, 0, 1) = 1.0f;
  const double sigma = std::hypot(127.5, 191.25);
  const double mu = std::hypot(127.5, -63.75);
  EXPECT_NEAR(Colorfulness(image), sigma + 0.3 * mu, 1e-4);
  EXPECT_THROW(Colorfulness(Image(2, 2, 1)), Error);
  EXPECT_THROW(AbsoluteColorfulness(Image(2, 2, 1)), Error);
}

// Half red, half green: rg = 255 and -255, yb = 127.5 in both.
TEST(Colorfulness, AbsoluteVariantIgnoresSign) {
  Image image(2, 1, 3, 0.0f);
  image.At(0, 0, 0) = 1.0f;
  image.At(1, 0, 1) = 1.0f;
  EXPECT_NEAR(Colorfulness(image), 255.0 + 0.3 * 127.5, 1e-4);
  EXPECT_NEAR(AbsoluteColorfulness(image), 0.3 * std::hypot(255.0, 127.5), 1e-4);
  const Image one_hue(2, 2, 3, 0.4f);
  EXPECT_NEAR(AbsoluteColorfulness(one_hue), 0.0, 1e-6);
}

}  // namespace
}  // namespace color3d
