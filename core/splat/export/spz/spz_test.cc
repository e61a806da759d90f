#include "core/splat/export/spz/spz.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/splat/model/spherical_harmonics.h"
#include "tests/support/formats/viewer_files.h"
#include "tests/support/scenes/random_model.h"

namespace color3d {
namespace {

ViewerGaussians Gaussians(size_t count, int degree) {
  ThreadPool pool(2);
  const GaussianModel model = RandomModel({count, 3, degree, 0, /*chroma_size=*/0.03});
  return ForViewers(model, FitRgbHarmonics(model, pool), ExportFrame(), pool);
}

TEST(SpzTest, BothVersionsRoundTripWithinPrecision) {
  ThreadPool pool(2);
  for (const SpzVersion version : {SpzVersion::k2, SpzVersion::k4}) {
    for (const int degree : {0, 1, 2, 3}) {
      const ViewerGaussians g = Gaussians(300, degree);
      const ViewerGaussians file = ReadSpz(EncodeSpz(g, version, pool));
      ASSERT_EQ(file.size(), g.size());
      ASSERT_EQ(file.sh_degree, degree);
      const int coefficients = ShCoefficients(degree);
      const std::vector<size_t> partner = PartnersIn(file, g);
      for (size_t i = 0; i < g.size(); ++i) {
        const size_t j = partner[i];
        double dot = 0.0;
        for (int k = 0; k < 4; ++k) dot += g.rotation[4 * i + k] * file.rotation[4 * j + k];
        EXPECT_GT(std::abs(dot), version == SpzVersion::k2 ? 0.995 : 0.99999);
        for (int k = 0; k < 3; ++k) {
          EXPECT_NEAR(g.position[3 * i + k], file.position[3 * j + k], 1e-6);
          EXPECT_NEAR(g.log_scale[3 * i + k], file.log_scale[3 * j + k], 0.5001 / 16.0);
          const float color = g.sh[i * coefficients * 3 + k];
          EXPECT_NEAR(std::clamp(color, -0.5f / 0.15f, 0.5f / 0.15f),
                      file.sh[j * coefficients * 3 + k],
                      0.5001 / 255.0 / 0.15);
        }
        for (int k = 3; k < 3 * coefficients; ++k) {
          const float wanted = std::clamp(g.sh[i * coefficients * 3 + k], -1.0f, 1.0f);
          EXPECT_NEAR(wanted, file.sh[j * coefficients * 3 + k], k < 12 ? 0.032 : 0.063);
        }
        const auto opacity = [](float logit) { return 1.0 / (1.0 + std::exp(-logit)); };
        EXPECT_NEAR(opacity(g.opacity_logit[i]), opacity(file.opacity_logit[j]), 0.51 / 255.0);
      }
    }
  }
}

TEST(SpzTest, DistantScenesUseFewerFractionalBits) {
  ThreadPool pool(1);
  ViewerGaussians g = Gaussians(10, 0);
  for (float& x : g.position) x *= 1e5f;
  const ViewerGaussians file = ReadSpz(EncodeSpz(g, SpzVersion::k4, pool));
  const std::vector<size_t> partner = PartnersIn(file, g);
  for (size_t i = 0; i < g.position.size(); ++i) {
    EXPECT_NEAR(g.position[i], file.position[3 * partner[i / 3] + i % 3], 0.04);
  }
}

TEST(SpzTest, RejectsUnsupportedModels) {
  ThreadPool pool(1);
  const auto refusal = [&](const ViewerGaussians& g) -> std::string {
    try {
      EncodeSpz(g, SpzVersion::k4, pool);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(Gaussians(0, 1)), testing::HasSubstr("no Gaussians"));
  EXPECT_EQ(refusal(Gaussians(1, 3)), "");
  ViewerGaussians g = Gaussians(5, 1);
  g.opacity_logit[3] = std::nanf("");
  EXPECT_THAT(refusal(g), testing::HasSubstr("opacity of Gaussian 3"));
  g = Gaussians(5, 1);
  g.position[0] = 1e9f;
  EXPECT_THAT(refusal(g), testing::HasSubstr("out of the range of SPZ"));
  g = Gaussians(5, 1);
  for (float& s : g.log_scale) s -= 15.0f;
  EXPECT_THAT(refusal(g), testing::HasSubstr("smaller than"));
}

}  // namespace
}  // namespace color3d
