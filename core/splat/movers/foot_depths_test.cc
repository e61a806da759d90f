#include "core/splat/movers/foot_depths.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

constexpr int kWidth = 40;
constexpr int kHeight = 30;

// Ground whose depth decreases by 0.1 per row.
float GroundDepth(int row) { return 5.0f - 0.1f * static_cast<float>(row); }

SurveyedView ViewAt(double time_s, double x = 0.0) {
  SurveyedView view;
  view.posed.camera = {kWidth, kHeight, 40.0, 40.0, 20.0, 15.0};
  view.posed.cam_from_world.translation.x() = x;
  view.posed.time_s = time_s;
  view.moving = view.depth = Image(kWidth, kHeight, 1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x_px = 0; x_px < kWidth; ++x_px) view.depth.At(0, y, x_px) = GroundDepth(y);
  }
  return view;
}

void Move(int left, int right, int top, int foot, SurveyedView* view) {
  for (int y = top; y <= foot; ++y) {
    for (int x = left; x <= right; ++x) view->moving.At(0, y, x) = 1.0f;
  }
}

class FootDepthsTest : public ::testing::Test {
 protected:
  std::vector<Image> Find() { return FootDepths(views_, pool_); }
  ThreadPool pool_{2};
  std::vector<SurveyedView> views_;
};

TEST_F(FootDepthsTest, RegionTakesDepthAtItsFoot) {
  views_ = {ViewAt(0.0), ViewAt(1.0, 0.5)};
  Move(5, 9, 10, 20, &views_[0]);
  Move(20, 24, 10, 25, &views_[0]);
  const std::vector<Image> depths = Find();
  EXPECT_FLOAT_EQ(depths[0].At(0, 12, 6), GroundDepth(20));
  EXPECT_FLOAT_EQ(depths[0].At(0, 12, 22), GroundDepth(25));
  EXPECT_EQ(depths[0].At(0, 12, 15), 0.0f);
  EXPECT_EQ(depths[1].At(0, 12, 6), 0.0f);
}

TEST_F(FootDepthsTest, FallsBackToUsualDepthWithoutGround) {
  views_ = {ViewAt(0.0), ViewAt(1.0, 0.5)};
  Move(5, 9, 10, 20, &views_[0]);
  for (int x = 0; x < kWidth; ++x) views_[0].depth.At(0, 20, x) = 0.0f;
  EXPECT_FLOAT_EQ(Find()[0].At(0, 12, 6), static_cast<float>(MedianDepth(views_[0])));
}

TEST_F(FootDepthsTest, StaticCameraJoinsTornLimbs) {
  views_ = {ViewAt(0.0), ViewAt(1.0)};
  Move(5, 12, 15, 25, &views_[0]);
  Move(6, 8, 5, 8, &views_[0]);
  Move(30, 33, 5, 8, &views_[0]);  // a bird
  const std::vector<Image> depths = Find();
  EXPECT_FLOAT_EQ(depths[0].At(0, 6, 7), GroundDepth(25));
  EXPECT_FLOAT_EQ(depths[0].At(0, 6, 31), GroundDepth(8));
}

TEST_F(FootDepthsTest, StaticCameraDepthIsSmoothOverTime) {
  for (int i = 0; i < 9; ++i) {
    views_.push_back(ViewAt(0.1 * i));
    const int foot = i == 4 ? 15 : 24;  // the legs were not detected as moving
    Move(5 + i / 2, 12 + i / 2, 8, foot, &views_.back());
    Move(30, 33, 8, 12, &views_.back());
  }
  std::swap(views_[0], views_[8]);  // in any order
  for (const Image& depth : Find()) {
    EXPECT_FLOAT_EQ(*std::max_element(depth.data.begin(), depth.data.end()), GroundDepth(12));
    EXPECT_FLOAT_EQ(depth.At(0, 10, 12), GroundDepth(24));
  }
}

TEST_F(FootDepthsTest, AcceptsNoViewsAndNoMotion) {
  EXPECT_TRUE(Find().empty());
  views_ = {ViewAt(0.0)};
  const std::vector<Image> depths = Find();
  ASSERT_EQ(depths.size(), 1u);
  EXPECT_EQ(depths[0].At(0, 10, 10), 0.0f);
}

}  // namespace
}  // namespace color3d
