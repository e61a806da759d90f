#include "core/splat/export/sog/sog.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "core/base/error.h"
#include "core/splat/export/export.h"
#include "core/splat/model/spherical_harmonics.h"
#include "tests/support/formats/viewer_files.h"
#include "tests/support/scenes/random_model.h"

namespace color3d {
namespace {

const ExportFrame kFrame;

ViewerGaussians Gaussians(size_t count, int degree) {
  ThreadPool pool(2);
  const GaussianModel model = RandomModel({count, 3, degree, 0, /*chroma_size=*/0.03});
  return ForViewers(model, FitRgbHarmonics(model, pool), kFrame, pool);
}

TEST(SogTest, RoundTripsWithinFormatPrecision) {
  ThreadPool pool(2);
  for (const int degree : {0, 1, 2, 3}) {
    const ViewerGaussians g = Gaussians(600, degree);
    const ViewerGaussians file = ReadSog(EncodeSog(g, pool));
    ASSERT_EQ(file.size(), g.size());
    ASSERT_EQ(file.sh_degree, degree);
    const std::vector<size_t> partner = PartnersIn(file, g);
    EXPECT_EQ(std::set<size_t>(partner.begin(), partner.end()).size(), g.size());
    const int row = 3 * ShCoefficients(degree);
    double harmonics = 0.0, lost = 0.0;
    for (size_t i = 0; i < g.size(); ++i) {
      const size_t j = partner[i];
      double dot = 0.0;
      for (int k = 0; k < 4; ++k) dot += g.rotation[4 * i + k] * file.rotation[4 * j + k];
      EXPECT_NEAR(std::abs(dot), 1.0, 1e-4);
      for (int k = 0; k < 3; ++k) {
        // Half a step of the logarithm's grid, whose derivative is 1 + |x|.
        EXPECT_NEAR(g.position[3 * i + k],
                    file.position[3 * j + k],
                    4e-5 * (1.0 + std::abs(g.position[3 * i + k])));
        EXPECT_NEAR(g.log_scale[3 * i + k], file.log_scale[3 * j + k], 0.25);  // in the tails
        EXPECT_NEAR(g.sh[i * row + k], file.sh[j * row + k], 0.15);
      }
      const auto opacity = [](float logit) { return 1.0 / (1.0 + std::exp(-logit)); };
      EXPECT_NEAR(opacity(g.opacity_logit[i]), opacity(file.opacity_logit[j]), 0.51 / 255.0);
      for (int k = 3; k < row; ++k) {
        harmonics += std::pow(g.sh[i * row + k], 2.0);
        lost += std::pow(g.sh[i * row + k] - file.sh[j * row + k], 2.0);
      }
    }
    // Random harmonics are the worst case for a palette.
    if (degree > 0) {
      EXPECT_LT(lost, 0.6 * harmonics) << degree;
    }
  }
}

TEST(SogTest, RendersLikePly) {
  ThreadPool pool(2);
  GaussianModel model = RandomModel({3000, 3, 2, 0, /*chroma_size=*/0.03});
  for (size_t i = 0; i < model.size(); ++i) {
    model.position[3 * i + 2] += 6.0f;
    for (int k = 0; k < 3; ++k)
      model.log_scale[3 * i + k] = 0.3f * model.log_scale[3 * i + k] - 2.5f;
    for (int k = 1; k < 9; ++k) model.sh_l[9 * i + k] *= 0.2f;
  }
  const RgbHarmonics rgb = FitRgbHarmonics(model, pool);
  const ViewerGaussians ply = ReadPly(EncodeGaussianPly(model, rgb, kFrame, pool));
  const ViewerGaussians sog = ReadSog(EncodeSog(ForViewers(model, rgb, kFrame, pool), pool));
  const Camera camera{160, 120, 150.0, 150.0, 80.0, 60.0};
  const double psnr = PsnrOf(RenderForViewers(ply, camera, Pose(), pool),
                             RenderForViewers(sog, camera, Pose(), pool));
  std::printf("SOG against PLY: %.1f dB\n", psnr);
  EXPECT_GE(psnr, 30.0);
}

TEST(SogTest, WritesSameBytesForAnyThreadCount) {
  const ViewerGaussians g = Gaussians(5000, 2);
  ThreadPool one(1), two(2);
  EXPECT_EQ(EncodeSog(g, two), EncodeSog(g, one));
}

TEST(SogTest, EncodesEmptyModelAndOneGaussian) {
  ThreadPool pool(2);
  EXPECT_EQ(ReadSog(EncodeSog(Gaussians(0, 2), pool)).size(), 0u);
  const ViewerGaussians one = Gaussians(1, 3);
  const ViewerGaussians file = ReadSog(EncodeSog(one, pool));
  ASSERT_EQ(file.size(), 1u);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(file.position[k], one.position[k], 1e-5);
    EXPECT_NEAR(file.log_scale[k], one.log_scale[k], 1e-5);
  }
  ASSERT_EQ(file.sh.size(), one.sh.size());
  for (size_t k = 0; k < one.sh.size(); ++k) EXPECT_NEAR(file.sh[k], one.sh[k], 1e-5) << k;
}

TEST(SogTest, RejectsNonFiniteValues) {
  ThreadPool pool(1);
  ViewerGaussians g = Gaussians(4, 1);
  g.position[7] = std::numeric_limits<float>::infinity();
  try {
    EncodeSog(g, pool);
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("position of Gaussian 2"));
  }
  g = Gaussians(4, 1);
  g.sh[13] = std::nanf("");
  EXPECT_THROW(EncodeSog(g, pool), Error);
}

}  // namespace
}  // namespace color3d
