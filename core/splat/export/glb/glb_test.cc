#include "core/splat/export/glb/glb.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "tests/support/formats/viewer_files.h"
#include "tests/support/scenes/random_model.h"

namespace color3d {
namespace {

ViewerGaussians Gaussians(size_t count, int degree) {
  ThreadPool pool(2);
  const GaussianModel model = RandomModel({count, 3, degree, 0, /*chroma_size=*/0.03});
  return ForViewers(model, FitRgbHarmonics(model, pool), ExportFrame(), pool);
}

TEST(GlbTest, ReadsBackExactly) {
  for (const int degree : {0, 1, 2, 3}) {
    const ViewerGaussians g = Gaussians(degree == 0 ? 1 : 200, degree);
    const std::string bytes = EncodeGlb(g);
    EXPECT_EQ(bytes.size() % 4, 0u);
    const ViewerGaussians file = ReadGlb(bytes);
    ASSERT_EQ(file.size(), g.size());
    EXPECT_EQ(file.position, g.position);
    EXPECT_EQ(file.rotation, g.rotation);
    ASSERT_EQ(file.sh_degree, degree);
    EXPECT_EQ(file.sh, g.sh);
    for (size_t i = 0; i < g.size(); ++i) {
      EXPECT_NEAR(file.opacity_logit[i], g.opacity_logit[i], 1e-5);
      for (size_t k = 3 * i; k < 3 * i + 3; ++k) {
        EXPECT_NEAR(file.log_scale[k], g.log_scale[k], 1e-5);
      }
    }
  }
}

TEST(GlbTest, RejectsEmptyAndNonFiniteModels) {
  EXPECT_THROW(EncodeGlb(Gaussians(0, 0)), Error);
  ViewerGaussians g = Gaussians(3, 1);
  g.log_scale[4] = std::numeric_limits<float>::infinity();
  try {
    EncodeGlb(g);
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("scale of Gaussian 1"));
  }
}

}  // namespace
}  // namespace color3d
