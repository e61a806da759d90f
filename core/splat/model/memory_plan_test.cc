#include "core/splat/model/memory_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int64_t kMiB = int64_t{1} << 20;

MemoryDemand DemandOf(int width, int height, int views) {
  MemoryDemand demand;
  const Camera camera{width, height, 1.0 * width, 1.0 * width, 0.5 * width, 0.5 * height};
  demand.views.assign(views, {camera, camera});
  demand.max_side_px = 800;
  demand.max_gaussians = 150'000;
  demand.sh_degree = 2;
  return demand;
}

TEST(MemoryPlan, ChangesNothingWithEnoughMemory) {
  const MemoryPlan plan = PlanGeometryMemory(DemandOf(1600, 1200, 50), 8192 * kMiB);
  EXPECT_EQ(plan.max_side_px, 800);
  EXPECT_EQ(plan.max_gaussians, 150'000);
  EXPECT_EQ(plan.note, "");
  EXPECT_EQ(plan.image_cache_bytes, int64_t{4} * 800 * 600 * 50);
  EXPECT_LE(plan.estimated_bytes, 2048 * kMiB);
}

TEST(MemoryPlan, DynamicSceneMemoryIsIndependentOfFrames) {
  MemoryDemand demand = DemandOf(1600, 1200, 100);
  const int64_t of_photos = PlanGeometryMemory(demand, 8192 * kMiB).estimated_bytes;
  demand.moves = true;
  const MemoryPlan plan = PlanGeometryMemory(demand, 8192 * kMiB);
  EXPECT_LT(plan.estimated_bytes, of_photos);
  EXPECT_GT(plan.target_cache_bytes, 0);
  demand.views.resize(4000, demand.views.front());
  const MemoryPlan longer = PlanGeometryMemory(demand, 8192 * kMiB);
  EXPECT_EQ(longer.estimated_bytes, plan.estimated_bytes);
  EXPECT_EQ(longer.target_cache_bytes, plan.target_cache_bytes);
}

TEST(MemoryPlan, ReducesCachesThenGaussiansThenPixels) {
  const MemoryDemand demand = DemandOf(1600, 1200, 50);
  const int64_t wanted = GeometryBytes(demand, 800, 150'000);
  const MemoryPlan tight = PlanGeometryMemory(demand, wanted);
  EXPECT_EQ(tight.max_gaussians, 150'000);
  EXPECT_EQ(tight.image_cache_bytes, 0);
  EXPECT_EQ(tight.note, "");
  int last_side = 800, last_count = 150'000;
  bool fewer_at_full_size = false, smaller = false;
  for (int64_t budget = wanted; budget > 240 * kMiB; budget = budget * 9 / 10) {
    const MemoryPlan plan = PlanGeometryMemory(demand, budget);
    EXPECT_LE(plan.estimated_bytes, budget);
    EXPECT_LE(GeometryBytes(demand, plan.max_side_px, plan.max_gaussians), budget);
    EXPECT_LE(plan.max_side_px, last_side);
    if (plan.max_side_px == last_side) {
      EXPECT_LE(plan.max_gaussians, last_count);
    }
    fewer_at_full_size |= plan.max_side_px == 800 && plan.max_gaussians < 150'000;
    smaller |= plan.max_side_px < 800;
    if (plan.max_gaussians < 150'000 || plan.max_side_px < 800) {
      EXPECT_THAT(plan.note, testing::HasSubstr("Gaussians instead of 150000"));
    }
    last_side = plan.max_side_px;
    last_count = plan.max_gaussians;
  }
  EXPECT_TRUE(fewer_at_full_size);
  EXPECT_TRUE(smaller);
}

std::string Refused(const MemoryDemand& demand, int64_t budget) {
  try {
    PlanGeometryMemory(demand, budget);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kResourceExhausted);
    return e.what();
  }
  return "";
}

TEST(MemoryPlan, NamesSizeOfPhotoTooLargeToDecode) {
  EXPECT_THAT(Refused(DemandOf(30000, 20000, 3), 4096 * kMiB),
              testing::HasSubstr("most of it for a photo of 30000 x 20000 px"));
  EXPECT_THAT(Refused(DemandOf(640, 480, 3), 10 * kMiB), testing::HasSubstr("10 MiB may be used"));
  EXPECT_THAT(Refused(DemandOf(640, 480, 3), 0), testing::HasSubstr("0 MiB may be used"));
}

TEST(MemoryPlan, DoesNotRaiseSmallGaussianCap) {
  MemoryDemand demand = DemandOf(640, 480, 3);
  demand.max_gaussians = 7;
  EXPECT_EQ(PlanGeometryMemory(demand, 1024 * kMiB).max_gaussians, 7);
}

}  // namespace
}  // namespace color3d
