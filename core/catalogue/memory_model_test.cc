#include "core/catalogue/memory_model.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/catalogue/stages.h"

namespace color3d {
namespace {

constexpr int64_t kMiB = int64_t{1} << 20;
constexpr StageWork kFern = {
    .views = 20, .megapixels = 0.1875, .iterations = 1500, .gaussians = 40'000, .sh_degree = 2};

TEST(MemoryModelTest, BytesPerGaussianFollowDegreeAndChannels) {
  EXPECT_EQ(BytesPerGaussian(2), 1008);
  EXPECT_EQ(BytesPerGaussian(3), 1316);
  EXPECT_EQ(BytesPerGaussian(3, 3), 2724);
  EXPECT_EQ(BytesPerGaussianWithPairs(2, 1), 1008 + 8 * 42);
}

TEST(MemoryModelTest, KnowsEveryStage) {
  for (const Stage& stage : StageCatalogue()) {
    EXPECT_GE(EstimatePeakBytes(stage.kind, kFern), 100 * kMiB) << stage.kind;
    EXPECT_LE(EstimatePeakBytes(stage.kind, kFern), 2048 * kMiB) << stage.kind;
  }
  EXPECT_THROW(EstimatePeakBytes("paint_fence", kFern), Error);
}

}  // namespace
}  // namespace color3d
