#include "core/splat/chroma/chroma_adjustment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

// One Gaussian of this colour, without view dependence.
GaussianModel OneGaussian(double l, double a, double b) {
  GaussianModel model;
  model.channels = 3;
  model.opacity_logit = {0.0f};
  model.sh_l = {static_cast<float>((l / 100.0 - 0.5) / kShDc)};
  model.sh_a = {static_cast<float>(a / 255.0 / kShDc)};
  model.sh_b = {static_cast<float>(b / 255.0 / kShDc)};
  return model;
}

double AOf(const GaussianModel& model) { return model.sh_a[0] * kShDc * 255.0; }
double BOf(const GaussianModel& model) { return model.sh_b[0] * kShDc * 255.0; }

TEST(ChromaAdjustment, DefaultKeepsModelBitForBit) {
  GaussianModel model = OneGaussian(40.0, 12.3, -7.7);
  AdjustChroma({}, &model);
  const GaussianModel same = OneGaussian(40.0, 12.3, -7.7);
  EXPECT_EQ(model.sh_a, same.sh_a);
  EXPECT_EQ(model.sh_b, same.sh_b);
}

TEST(ChromaAdjustment, SaturationScalesChroma) {
  GaussianModel model = OneGaussian(40.0, 12.0, -8.0);
  AdjustChroma({.saturation = 1.5}, &model);
  EXPECT_NEAR(AOf(model), 18.0, 1e-4);
  EXPECT_NEAR(BOf(model), -12.0, 1e-4);
  AdjustChroma({.saturation = 0.0}, &model);
  EXPECT_EQ(AOf(model), 0.0);
}

TEST(ChromaAdjustment, MiddleGrayTakesTintAndWarmth) {
  GaussianModel model = OneGaussian(50.0, 0.0, 0.0);
  AdjustChroma({.tint = -6.0, .warmth = 14.0}, &model);
  EXPECT_NEAR(AOf(model), -6.0, 1e-4);
  EXPECT_NEAR(BOf(model), 14.0, 1e-4);
}

// The inverse of Lab's f, for X / Xn and Z / Zn above the linear part.
double Cubed(double f) { return f * f * f; }

TEST(ChromaAdjustment, WhiteBalanceIsVonKriesInXyz) {
  const ChromaAdjustment adjustment{.tint = 9.0, .warmth = -12.0};
  double x_ratio = 0.0, z_ratio = 0.0;
  for (const double l : {30.0, 50.0, 80.0}) {
    for (const double a : {-20.0, 0.0, 25.0}) {
      const double b = 0.5 * a + 3.0;
      GaussianModel model = OneGaussian(l, a, b);
      AdjustChroma(adjustment, &model);
      const double y = (l + 16.0) / 116.0;
      const double x = Cubed(y + AOf(model) / 500.0) / Cubed(y + a / 500.0);
      const double z = Cubed(y - BOf(model) / 200.0) / Cubed(y - b / 200.0);
      if (x_ratio == 0.0) {
        x_ratio = x;
        z_ratio = z;
      }
      // The factors are the same for every colour.
      EXPECT_NEAR(x / x_ratio, 1.0, 1e-5);
      EXPECT_NEAR(z / z_ratio, 1.0, 1e-5);
    }
  }
}

TEST(ChromaAdjustment, RejectsOutOfRangeValues) {
  GaussianModel model = OneGaussian(50.0, 1.0, 1.0);
  EXPECT_THROW(AdjustChroma({.saturation = -0.1}, &model), Error);
  EXPECT_THROW(AdjustChroma({.saturation = std::nan("")}, &model), Error);
  EXPECT_THROW(AdjustChroma({.warmth = 51.0}, &model), Error);
}

TEST(ChromaAdjustment, RefusesModelInSrgb) {
  GaussianModel model = OneGaussian(40.0, 12.3, -7.7);
  model.color_space = ColorSpace::kSrgb;
  EXPECT_NO_THROW(AdjustChroma({}, &model));
  EXPECT_THROW(AdjustChroma({.saturation = 1.5}, &model), Error);
}

}  // namespace
}  // namespace color3d
