#include "core/film/moving_regions.h"

#include <gtest/gtest.h>

#include <map>

#include "core/base/error.h"
#include "core/base/random.h"
#include "tests/support/scenes/test_scenes.h"
#include "tests/support/scenes/textured_corner.h"

namespace color3d {
namespace {

constexpr int kFrames = 12;
const Camera kCamera{320, 240, 330.0, 330.0, 160.0, 120.0};

// A camera that walks by, and a board that goes the other way and upwards.
struct Film {
  double step = 0.05;                              // of the camera, per frame
  double board_step = 0.025;                       // 0: there is no board
  double noise = 0.0;                              // L
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();  // rad per frame, about the camera's axes

  Pose PoseOf(int frame) const {
    const double t = frame - 0.5 * kFrames;
    Pose pose = LookAt({0.5 + step * t, -0.1, -1.3 + 0.3 * step * t}, {0.1, 0.4, 1.6});
    const Eigen::Vector3d angle = t * turn;
    if (angle.norm() > 0.0) {
      const Eigen::Quaterniond more(Eigen::AngleAxisd(angle.norm(), angle.normalized()));
      pose.rotation = (more * pose.rotation).normalized();
      pose.translation = more * pose.translation;
    }
    return pose;
  }
  MovingBoard BoardOf(int frame) const {
    const double t = frame - 0.5 * kFrames;
    return {{0.3 - board_step * t, 0.3 - 0.8 * board_step * t, 0.9}};
  }
  Image Luminance(int frame) const {
    Image image = RenderCorner(
        kCamera,
        PoseOf(frame),
        board_step > 0.0 ? std::optional(BoardOf(frame)) : std::optional<MovingBoard>());
    Random random(static_cast<uint64_t>(frame) + 1);
    for (float& v : image.data) {
      v = 100.0f * v + static_cast<float>(noise * random.NextNormal());
    }
    return image;
  }
};

struct Found {
  ShotMotion motion;
  std::map<int, Image> moving;
};

Found Find(const Film& film, int first = 0, int count = kFrames, int threads = 2) {
  std::vector<std::shared_ptr<const Image>> pictures;
  for (int i = 0; i < count; ++i) {
    pictures.push_back(std::make_shared<const Image>(film.Luminance(first + i)));
  }
  ThreadPool pool(threads);
  Found found;
  found.motion = FindMovingRegions({count, [&](int frame) { return pictures[frame]; }},
                                   pool,
                                   CancellationToken(),
                                   [&](int frame, const Image& moving) {
                                     EXPECT_TRUE(found.moving.emplace(frame, moving).second);
                                   });
  EXPECT_EQ(found.moving.size(), static_cast<size_t>(count));
  return found;
}

// Intersection over union of all frames' regions.
double AgreementWithTruth(const Found& found, const Film& film) {
  double both = 0.0, either = 0.0;
  for (const auto& [frame, moving] : found.moving) {
    const Image truth = MaskOfBoard(kCamera, film.PoseOf(frame), film.BoardOf(frame));
    for (size_t i = 0; i < truth.data.size(); ++i) {
      both += truth.data[i] > 0.0f && moving.data[i] > 0.0f;
      either += truth.data[i] > 0.0f || moving.data[i] > 0.0f;
    }
  }
  return both / either;
}

TEST(MovingRegionsTest, FindsObjectSeenByMovingCamera) {
  const Film film;
  const Found found = Find(film);
  EXPECT_GT(AgreementWithTruth(found, film), 0.6);
  EXPECT_FALSE(found.motion.camera_stands_still);
  EXPECT_GT(found.motion.background_px, 3.0);
  EXPECT_NEAR(found.motion.moving_share, 0.08, 0.04);
}

TEST(MovingRegionsTest, FindsMovingObjectInGrain) {
  const Film film{.noise = 3.0};
  EXPECT_GT(AgreementWithTruth(Find(film), film), 0.6);
}

TEST(MovingRegionsTest, FindsNothingInStaticScene) {
  const Found found = Find({.board_step = 0.0});
  EXPECT_LT(found.motion.moving_share, 0.01);
  EXPECT_FALSE(found.motion.camera_stands_still);
}

TEST(MovingRegionsTest, DetectsStillCamera) {
  const Film film{.step = 0.0, .noise = 1.0};
  const Found found = Find(film);
  EXPECT_TRUE(found.motion.camera_stands_still);
  EXPECT_LT(found.motion.background_px, 0.3);
  EXPECT_GT(AgreementWithTruth(found, film), 0.6);
}

TEST(MovingRegionsTest, DistinguishesTurningFromStillCamera) {
  const Film film{.step = 0.0, .turn = {0.002, 0.01, 0.0}};
  const Found found = Find(film);
  EXPECT_FALSE(found.motion.camera_stands_still);
  EXPECT_GT(AgreementWithTruth(found, film), 0.6);
}

// Each pair of frames is measured once, in blocks of frames from the beginning of the shot.
TEST(MovingRegionsTest, DoesNotDependOnThreadsOrFirstFrame) {
  const Film film{.step = 0.0, .noise = 1.0};
  constexpr int kLater = 3, kCount = 24, kFarthest = 8;
  const Found found = Find(film, 0, kCount, 1), later = Find(film, kLater, kCount, 3);
  for (int frame = kLater + kFarthest; frame < kCount - kFarthest; ++frame) {
    EXPECT_EQ(found.moving.at(frame).data, later.moving.at(frame - kLater).data) << frame;
  }
  EXPECT_GT(found.motion.moving_share, 0.01);
}

TEST(MovingRegionsTest, ClassifiesCameraMotion) {
  const Film still{.step = 0.0}, turning{.step = 0.0, .turn = {0.0, 0.01, 0.0}}, moving;
  EXPECT_EQ(CompareFrames(still.Luminance(3), still.Luminance(5)).motion, CameraMotion::kStill);
  EXPECT_EQ(CompareFrames(turning.Luminance(3), turning.Luminance(5)).motion, CameraMotion::kTurn);
  EXPECT_EQ(CompareFrames(moving.Luminance(3), moving.Luminance(7)).motion, CameraMotion::kMoved);
  const PairResidual flat = CompareFrames(Image(320, 240, 1, 50.0f), Image(320, 240, 1, 50.0f));
  EXPECT_EQ(flat.motion, CameraMotion::kUnknown);
  EXPECT_EQ(*std::max_element(flat.excess.data.begin(), flat.excess.data.end()), -1.0f);
  EXPECT_THROW(CompareFrames(Image(320, 240, 1), Image(300, 240, 1)), Error);
}

TEST(MovingRegionsTest, FindsNothingInFlatOrSingleFrames) {
  ThreadPool pool(2);
  for (const int count : {0, 1, 5}) {
    int handed_over = 0;
    const auto flat = std::make_shared<const Image>(64, 48, 1, 30.0f);
    const ShotMotion motion = FindMovingRegions(
        {count, [&](int) { return flat; }}, pool, CancellationToken(), [&](int, const Image&) {
          ++handed_over;
        });
    EXPECT_EQ(handed_over, count);
    EXPECT_EQ(motion.pairs, 0);
    EXPECT_FALSE(motion.camera_stands_still);
    EXPECT_EQ(motion.moving_share, 0.0);
  }
}

TEST(MovingRegionsTest, CanBeCancelled) {
  ThreadPool pool(2);
  CancellationToken cancel;
  cancel.Cancel();
  const auto flat = std::make_shared<const Image>(64, 48, 1, 30.0f);
  EXPECT_THROW(
      FindMovingRegions({5, [&](int) { return flat; }}, pool, cancel, [](int, const Image&) {}),
      Error);
}

TEST(FootRowTest, IsLowestRowOfLargestRegion) {
  Image moving(100, 50, 1);
  EXPECT_LT(LowestMovingRow(moving), 0.0);
  moving.At(0, 49, 3) = 1.0f;  // a speck
  EXPECT_LT(LowestMovingRow(moving), 0.0);
  for (int y = 10; y < 40; ++y) {
    for (int x = 20; x < 30; ++x) moving.At(0, y, x) = 1.0f;
  }
  EXPECT_DOUBLE_EQ(LowestMovingRow(moving), 0.8);
}

}  // namespace
}  // namespace color3d
