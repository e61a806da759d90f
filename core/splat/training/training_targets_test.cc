#include "core/splat/training/training_targets.h"

#include <gtest/gtest.h>

#include <memory>

namespace color3d {
namespace {

constexpr int kSide = 32;
constexpr int64_t kPlaneBytes = int64_t{4} * kSide * kSide;

class TrainingTargetsTest : public testing::Test {
 protected:
  PosedCamera View(int view) const {
    PosedCamera posed;
    posed.view = view;
    posed.camera = {kSide, kSide, 40.0, 40.0, 16.0, 16.0};
    return posed;
  }

  int asked_ = 0;
  PictureSource source_ = [this](int view) {
    ++asked_;
    return std::make_shared<const Image>(kSide, kSide, 1, static_cast<float>(view));
  };
};

TEST_F(TrainingTargetsTest, CachesWithinBudgetAndRereadsOthers) {
  TrainingTargets targets(source_, 1, 0.5f, 10 * kPlaneBytes);
  for (int round = 0; round < 3; ++round) {
    for (int view = 0; view < 40; ++view) {
      EXPECT_EQ(targets.Get(View(view), 0)->Row(0, 3)[5], 0.5f * static_cast<float>(view));
      EXPECT_LE(targets.kept_bytes(), 10 * kPlaneBytes);
    }
  }
  EXPECT_EQ(targets.kept_bytes(), 10 * kPlaneBytes);
  EXPECT_EQ(asked_, 40 + 30 + 30);
}

TEST_F(TrainingTargetsTest, EvictsPicturesOfOtherLevels) {
  TrainingTargets targets(source_, 1, 1.0f, 10 * kPlaneBytes);
  for (int view = 0; view < 40; ++view) targets.Get(View(view), 1);
  EXPECT_EQ(targets.kept_bytes(), 10 * kPlaneBytes);
  for (int view = 0; view < 40; ++view) targets.Get(View(view), 0);
  EXPECT_EQ(targets.kept_bytes(), 10 * kPlaneBytes);
  asked_ = 0;
  for (int view = 0; view < 40; ++view) targets.Get(View(view), 0);
  EXPECT_EQ(asked_, 30);  // ten are of this level now
}

}  // namespace
}  // namespace color3d
