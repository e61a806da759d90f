#include "core/carry/dense_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <set>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "tests/support/quiet_run.h"

namespace color3d {
namespace {

constexpr int kWidth = 128, kHeight = 96;
constexpr double kFocal = 110.0, kDepth = 4.0;

// Lightness of a painted wall, where cameras look from z = 0 to z = kDepth.
double Wall(double x, double y) {
  return 50.0 + 12.0 * std::sin(4.0 * x + y) + 10.0 * std::sin(9.0 * y - 2.0 * x) +
         8.0 * std::sin(17.0 * x) * std::cos(13.0 * y);
}

class DensePointsTest : public testing::Test {
 protected:
  // Six cameras along the wall; the first one is held out.
  DensePointsTest() {
    for (int i = 0; i < 6; ++i) {
      const double at = 0.4 * i;
      Image lab(kWidth, kHeight, 3);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          lab.At(0, y, x) = static_cast<float>(Wall(at + kDepth * (x + 0.5 - kWidth / 2.0) / kFocal,
                                                    kDepth * (y + 0.5 - kHeight / 2.0) / kFocal));
        }
      }
      View view;
      view.name = view.image_file = "p" + std::to_string(i) + ".png";
      view.camera = {kWidth, kHeight, kFocal, kFocal, kWidth / 2.0, kHeight / 2.0};
      view.captured_camera = view.camera;
      view.cam_from_world.translation = {-at, 0.0, 0.0};
      view.held_out = i == 0;
      WriteFileAtomic(scratch_.path() / view.image_file, EncodePng16(SrgbFromLab(lab)));
      scene_.views.push_back(view);
    }
    for (int i = 0; i < 40; ++i) {
      SparsePoint point;
      point.position = {0.05 * i, 0.5 * std::sin(i), kDepth};
      point.views = {0, 1, 2, 3, 4, 5};
      scene_.points.push_back(point);
    }
  }

  std::vector<SparsePoint> Points(int threads, const DensePointsOptions& options) {
    QuietRun run(threads);
    const ViewImages images(scene_, scratch_.path(), kWidth);
    return DensePoints(scene_, images, options, run.control());
  }

  ScratchFolder scratch_;
  Scene scene_;
};

TEST_F(DensePointsTest, CoversWallOnce) {
  const std::vector<SparsePoint> points =
      Points(2, {.depth_side_px = kWidth, .max_points = 1'000'000});
  // Each point of the wall once, including the part that only the last camera shows.
  EXPECT_GT(points.size(), 0.8 * kWidth * kHeight);
  EXPECT_LT(points.size(), 2.0 * kWidth * kHeight);
  double squares = 0.0;
  for (const SparsePoint& point : points) {
    squares += std::pow(point.position.z() - kDepth, 2);
    ASSERT_GE(point.views.size(), 3u);  // itself and two that agree
    ASSERT_GT(point.views.front(), 0);  // the held-out view is not used
    ASSERT_TRUE(std::is_sorted(point.views.begin(), point.views.end()));
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(points.size())), 0.02 * kDepth);
}

TEST_F(DensePointsTest, IgnoresMaskedPixels) {
  Image mask(kWidth, kHeight, 1, 1.0f);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth / 2; ++x) mask.At(0, y, x) = 0.0f;
  }
  WriteFileAtomic(scratch_.path() / "m.png", EncodePng8(mask));
  const DensePointsOptions options{.depth_side_px = kWidth, .max_points = 1'000'000};
  const size_t all = Points(2, options).size();
  scene_.views[2].mask_file = scene_.views[3].mask_file = "m.png";
  const std::vector<SparsePoint> points = Points(2, options);
  EXPECT_LT(points.size(), all);
  EXPECT_GT(points.size(), all / 3);
  for (const SparsePoint& point : points) {
    for (const int view : point.views) {
      if (view != 2 && view != 3) continue;
      const Eigen::Vector2d at = scene_.views[view].camera.Project(
          scene_.views[view].cam_from_world.Apply(point.position));
      ASSERT_GT(at.x(), kWidth / 2 - 1.5) << view;
    }
  }
}

TEST_F(DensePointsTest, IgnoresMovingObjects) {
  const auto right = std::make_shared<const Image>([] {
    Image still(kWidth, kHeight, 1);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = kWidth / 2; x < kWidth; ++x) still.At(0, y, x) = 1.0f;
    }
    return still;
  }());
  QuietRun run(2);
  const ViewImages images(scene_, scratch_.path(), kWidth);
  const std::vector<SparsePoint> points =
      DensePoints(scene_,
                  images,
                  {.depth_side_px = kWidth, .max_points = 1'000'000},
                  run.control(),
                  [&](int view) { return view == 1 ? nullptr : right; });
  EXPECT_GT(points.size(), 0.2 * kWidth * kHeight);
  for (const SparsePoint& point : points) {
    for (const int view : point.views) {
      const Eigen::Vector2d at = scene_.views[view].camera.Project(
          scene_.views[view].cam_from_world.Apply(point.position));
      ASSERT_TRUE(view == 1 || at.x() > kWidth / 2 - 1.5) << view;
    }
  }
}

// The same cameras at four times, with another texture on the wall at each.
TEST_F(DensePointsTest, ComparesViewsOfOneTimeOnly) {
  Scene rig = scene_;
  for (int time = 1; time < 4; ++time) {
    for (int i = 0; i < 6; ++i) rig.views.push_back(scene_.views[i]);
  }
  for (int v = 0; v < 24; ++v) {
    rig.views[v].moment = Moment{0.1 * (v / 6), v % 6};
    rig.views[v].held_out = false;
  }
  for (SparsePoint& point : rig.points) {
    point.views.resize(24);
    std::iota(point.views.begin(), point.views.end(), 0);
  }
  QuietRun run(2);
  const ViewImages images(rig, scratch_.path(), kWidth);
  const std::vector<SparsePoint> points =
      DensePoints(rig,
                  images,
                  {.max_views = 14, .depth_side_px = kWidth, .max_points = 1'000'000},
                  run.control());
  std::set<int> seen;
  for (const SparsePoint& point : points) {
    for (const int view : point.views) {
      ASSERT_EQ(view / 6, point.views.front() / 6);
      seen.insert(view);
    }
  }
  EXPECT_EQ(seen, (std::set<int>{0, 1, 2, 3, 4, 5, 12, 13, 14, 15, 16, 17}));
}

TEST_F(DensePointsTest, ComparesFramesOfOneCameraOverTime) {
  for (int v = 0; v < 6; ++v) scene_.views[v].moment = Moment{0.1 * v, 0};
  EXPECT_GT(Points(2, {.depth_side_px = kWidth, .max_points = 1'000'000}).size(),
            0.8 * kWidth * kHeight);
}

TEST_F(DensePointsTest, DoesNotDependOnThreads) {
  const std::vector<SparsePoint> one = Points(1, {.depth_side_px = kWidth, .max_points = 500});
  const std::vector<SparsePoint> three = Points(3, {.depth_side_px = kWidth, .max_points = 500});
  ASSERT_EQ(one.size(), 500u);
  ASSERT_EQ(three.size(), 500u);
  double lowest = 1e9, highest = -1e9;
  for (size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].position, three[i].position);
    EXPECT_EQ(one[i].views, three[i].views);
    lowest = std::min(lowest, one[i].position.y());
    highest = std::max(highest, one[i].position.y());
  }
  EXPECT_LT(lowest, -1.2);
  EXPECT_GT(highest, 1.2);
}

TEST_F(DensePointsTest, IsEmptyWithoutNeighborsOrPoints) {
  Scene lonely = scene_;
  lonely.points.clear();
  QuietRun run(1);
  const ViewImages images(lonely, scratch_.path(), kWidth);
  EXPECT_TRUE(DensePoints(lonely, images, {}, run.control()).empty());
}

}  // namespace
}  // namespace color3d
