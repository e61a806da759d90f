#include "core/splat/export/rgb_refine.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"
#include "tests/support/scenes/random_model.h"

namespace color3d {
namespace {

// A wall of overlapping, half-transparent Gaussians of different chroma: where Lab and RGB blend
// differently.
GaussianModel MixedWall() {
  GaussianModel m = RandomModel({400, 3, 1, 0, /*chroma_size=*/0.03});
  Random random(9);
  for (size_t i = 0; i < m.size(); ++i) {
    m.position[3 * i] = static_cast<float>(random.NextUniform(-1.0, 1.0));
    m.position[3 * i + 1] = static_cast<float>(random.NextUniform(-1.0, 1.0));
    m.position[3 * i + 2] = static_cast<float>(random.NextUniform(2.5, 3.0));
    for (int k = 0; k < 3; ++k) m.log_scale[3 * i + k] = -2.0f;
    m.sh_a[i] *= 8.0f;
    m.sh_b[i] *= 8.0f;
  }
  return m;
}

std::vector<RgbView> ThreeViews() {
  std::vector<RgbView> views(3);
  for (int i = 0; i < 3; ++i) {
    views[i].camera = {64, 48, 60.0, 60.0, 32.0, 24.0};
    views[i].cam_from_world.translation = {0.2 * (i - 1), 0.0, 0.0};
  }
  views[1].fitted = false;
  return views;
}

TEST(RefineRgbHarmonicsTest, ReducesErrorOfRgbBlending) {
  ThreadPool pool(2);
  NoCheckpoints none;
  NullObserver silent;
  const CancellationToken cancel;
  const RunControl run{pool, none, silent, cancel};
  const GaussianModel m = MixedWall();
  const RgbHarmonics start = FitRgbHarmonics(m, pool);
  RgbRefineOptions options;
  options.epochs = 30;
  const RgbRefinement refined = RefineRgbHarmonics(m, start, ThreeViews(), options, run);
  std::printf("mixed wall: %.2f dB (worst %.2f) before, %.2f (%.2f) after refinement\n",
              refined.before.mean_psnr_db,
              refined.before.worst_psnr_db,
              refined.after.mean_psnr_db,
              refined.after.worst_psnr_db);
  EXPECT_GT(refined.after.mean_psnr_db, refined.before.mean_psnr_db + 0.5);
  EXPECT_LE(refined.after.worst_psnr_db, refined.after.mean_psnr_db);
  EXPECT_EQ(refined.harmonics.sh.size(), start.sh.size());
  const RgbRefinement again = RefineRgbHarmonics(m, start, ThreeViews(), options, run);
  EXPECT_EQ(again.harmonics.sh, refined.harmonics.sh);
  // No epochs return the start unchanged.
  options.epochs = 0;
  const RgbRefinement unchanged = RefineRgbHarmonics(m, start, ThreeViews(), options, run);
  EXPECT_EQ(unchanged.harmonics.sh, start.sh);
  EXPECT_EQ(unchanged.after.mean_psnr_db, unchanged.before.mean_psnr_db);
}

TEST(RefineRgbHarmonicsTest, RejectsBadInputAndCanBeCancelled) {
  ThreadPool pool(1);
  NoCheckpoints none;
  NullObserver silent;
  const GaussianModel m = MixedWall();
  const RgbHarmonics start = FitRgbHarmonics(m, pool);
  const auto run = [&](const std::vector<RgbView>& views,
                       const RgbRefineOptions& options,
                       const CancellationToken& cancel) {
    RefineRgbHarmonics(m, start, views, options, {pool, none, silent, cancel});
  };
  RgbRefineOptions options;
  EXPECT_THROW(run({}, options, {}), Error);
  options.learning_rate = std::nan("");
  EXPECT_THROW(run(ThreeViews(), options, {}), Error);
  CancellationToken cancel;
  cancel.Cancel();
  EXPECT_THROW(run(ThreeViews(), {}, cancel), Error);
}

}  // namespace
}  // namespace color3d
