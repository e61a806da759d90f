#include "core/stage/sources/chroma_budget.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

Scene SceneOf(size_t views, bool has_times) {
  Scene scene;
  scene.views.resize(views);
  for (size_t i = 0; i < views && has_times; ++i) {
    scene.views[i].moment = Moment{.time_s = 0.1 * static_cast<double>(i)};
    scene.views[i].cam_from_world.translation.x() = static_cast<double>(i);
  }
  return scene;
}

TEST(ChromaBudgetTest, KeepsLessOfManyOrMovingFrames) {
  GaussianModel still, moving;
  moving.motion.center.resize(1);
  ASSERT_EQ(moving.motion.size(), 1u);
  const ChromaOptions photos, frames = ForManyFrames({});
  ASSERT_FALSE(frames == photos);
  ASSERT_TRUE(SceneOf(2, true).capture().is_dynamic);
  const auto of = [&](size_t views, bool has_times, const GaussianModel& geometry) {
    return ChromaWithinMemory({}, SceneOf(views, has_times), geometry, int64_t{16} << 30);
  };
  EXPECT_EQ(of(65, false, still), photos);
  EXPECT_EQ(of(64, true, still), photos) << "frames of a still place, as few as photos";
  EXPECT_EQ(of(65, true, still), frames);
  EXPECT_EQ(of(64, true, moving), frames);
}

TEST(ChromaBudgetTest, ShrinksWithMemory) {
  const ChromaOptions little = ChromaWithinMemory({}, SceneOf(8, false), {}, int64_t{1} << 30);
  EXPECT_EQ(little.memory_budget_bytes, int64_t{512} << 20);
  EXPECT_EQ(little.target_budget_bytes, int64_t{128} << 20);
}

}  // namespace
}  // namespace color3d
