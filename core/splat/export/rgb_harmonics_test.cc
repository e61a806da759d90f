#include "core/splat/export/rgb_harmonics.h"

#include <gtest/gtest.h>

#include "core/color/lab.h"
#include "core/splat/model/spherical_harmonics.h"
#include "tests/support/scenes/random_model.h"

namespace color3d {
namespace {

GaussianModel DullModel(size_t count, int degree, int chroma_degree) {
  return RandomModel({count, 3, degree, chroma_degree, /*chroma_size=*/0.03});
}

TEST(RgbHarmonicsTest, ReproducesColors) {
  ThreadPool pool(2);
  const GaussianModel m = DullModel(40, 2, 1);
  const RgbHarmonicsFitter fitter(m.sh_degree);
  const RgbHarmonics rgb = FitRgbHarmonics(m, pool);
  ASSERT_EQ(rgb.sh.size(), 40u * 9 * 3);
  double worst = 0.0;
  for (size_t i = 0; i < m.size(); ++i) {
    const Eigen::MatrixX3d colors = fitter.Colors(m, i);
    EXPECT_GE(colors.minCoeff(), 0.0);
    EXPECT_LE(colors.maxCoeff(), 1.0);
    Eigen::MatrixX3d sh(9, 3);
    for (int k = 0; k < 9; ++k) {
      for (int c = 0; c < 3; ++c) sh(k, c) = rgb.sh[(i * 9 + k) * 3 + c];
    }
    const Eigen::MatrixX3d back = ((fitter.Basis() * sh).array() + 0.5).matrix();
    worst = std::max(worst, (back - colors).cwiseAbs().mean());
  }
  EXPECT_LT(worst, 0.05);
  EXPECT_EQ(DegreeZero(rgb).sh.size(), 40u * 3);
  EXPECT_EQ(DegreeZero(rgb).sh[3], rgb.sh[27]);
}

TEST(RgbHarmonicsTest, FollowChromaAboveDegreeOfLuminance) {
  ThreadPool pool(1);
  const GaussianModel m = DullModel(30, 1, 3);
  const RgbHarmonics rgb = FitRgbHarmonics(m, pool);
  EXPECT_EQ(rgb.degree, 3);
  const RgbHarmonicsFitter fitter(3);
  double sum = 0.0;
  for (size_t i = 0; i < m.size(); ++i) {
    Eigen::MatrixX3d sh(16, 3);
    for (int k = 0; k < 16; ++k) {
      for (int c = 0; c < 3; ++c) sh(k, c) = rgb.sh[(i * 16 + k) * 3 + c];
    }
    const Eigen::MatrixX3d back = ((fitter.Basis() * sh).array() + 0.5).matrix();
    sum += (back - fitter.Colors(m, i)).cwiseAbs().mean();
  }
  EXPECT_LT(sum / 30.0, 0.03);
}

TEST(RgbHarmonicsTest, KeepThoseOfSrgbModel) {
  ThreadPool pool(1);
  GaussianModel m = RandomModel({10, 3, 2, 2});
  m.color_space = ColorSpace::kSrgb;
  const RgbHarmonics rgb = FitRgbHarmonics(m, pool);
  ASSERT_EQ(rgb.degree, 2);
  for (size_t i = 0; i < m.size(); ++i) {
    for (int k = 0; k < 9; ++k) {
      EXPECT_NEAR(rgb.sh[(i * 9 + k) * 3], m.sh_l[i * 9 + k], 1e-5);
      EXPECT_NEAR(rgb.sh[(i * 9 + k) * 3 + 1], m.sh_a[i * 9 + k], 1e-5);
      EXPECT_NEAR(rgb.sh[(i * 9 + k) * 3 + 2], m.sh_b[i * 9 + k], 1e-5);
    }
  }
}

TEST(RgbHarmonicsTest, DiffuseColorIsExact) {
  ThreadPool pool(1);
  GaussianModel m = DullModel(1, 0, 0);
  m.sh_l = {0.3f};
  m.sh_a = {0.1f};
  m.sh_b = {-0.05f};
  const RgbColor rgb = SrgbFromLab(
      LabColor{100.0 * (0.5 + kShDc * 0.3f), 255.0 * kShDc * 0.1f, -255.0 * kShDc * 0.05f});
  const RgbHarmonics fitted = FitRgbHarmonics(m, pool);
  EXPECT_NEAR(0.5 + kShDc * fitted.sh[0], rgb.r, 1e-6);
  EXPECT_NEAR(0.5 + kShDc * fitted.sh[1], rgb.g, 1e-6);
  EXPECT_NEAR(0.5 + kShDc * fitted.sh[2], rgb.b, 1e-6);
}

}  // namespace
}  // namespace color3d
