#include "core/scene/import/hold_out.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/base/error.h"

namespace color3d {
namespace {

using testing::HasSubstr;

// Cameras at different positions with the same times; `film`: all at one position.
Scene SceneOf(int cameras, int moments, bool film = false) {
  Scene scene;
  for (int camera = 0; camera < cameras; ++camera) {
    for (int t = 0; t < moments; ++t) {
      View view;
      view.name = std::to_string(camera) + "/" + std::to_string(1000 + t) + ".png";
      view.moment = Moment{0.5 * t, film ? t / 10 : camera};
      view.cam_from_world.translation.x() = film ? 0.0 : camera + 0.01 * t;
      scene.views.push_back(view);
    }
  }
  return scene;
}

std::string Said(double share, Scene scene) {
  try {
    HoldOutBlock(share, &scene);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    return e.what();
  }
  return "";
}

TEST(HoldOutBlockTest, IsInMiddleWithAllCameras) {
  Scene scene = SceneOf(3, 20);
  HoldOutBlock(0.2, &scene);
  for (const View& view : scene.views) {
    const int t = static_cast<int>(2.0 * view.moment->time_s);
    EXPECT_EQ(view.held_out, t >= 8 && t < 12) << view.name;
  }
}

TEST(HoldOutBlockTest, IsRefusedIfTooFewTimesRemain) {
  EXPECT_EQ(Said(0.5, SceneOf(2, 8)), "");
  EXPECT_THAT(Said(0.05, SceneOf(2, 20)),
              HasSubstr("0.05 of 20 time steps, which is less than two of them; give 0.1 or more"));
  EXPECT_THAT(Said(0.5, SceneOf(2, 6)), HasSubstr("1 are left for training before the block"));
  Scene still = SceneOf(1, 20);
  for (View& view : still.views) view.moment.reset();
  EXPECT_THAT(Said(0.2, still), HasSubstr("these views have no times"));
  Scene scene = SceneOf(1, 20);  // all times after the block are held out already
  for (int t = 12; t < 19; ++t) scene.views[t].held_out = true;
  EXPECT_THAT(Said(0.2, scene), HasSubstr("and 1 after it"));
}

TEST(HeldOutKindsTest, DistinguishesCamerasTimesAndBlocks) {
  Scene scene = SceneOf(3, 40);
  for (View& view : scene.views) {
    const int t = static_cast<int>(2.0 * view.moment->time_s);
    view.held_out = t % 8 == 4 || view.moment->shot == 1;
  }
  HoldOutBlock(0.1, &scene);  // 18 to 21, and 20 was held out before
  const std::vector<HoldOutKind> how = HeldOutKinds(scene);
  for (size_t i = 0; i < how.size(); ++i) {
    const View& view = scene.views[i];
    const int t = static_cast<int>(2.0 * view.moment->time_s);
    const HoldOutKind expected = view.moment->shot == 1 ? HoldOutKind::kCamera
                                 : t >= 18 && t < 22    ? HoldOutKind::kBlock
                                 : t % 8 == 4           ? HoldOutKind::kMoment
                                                        : HoldOutKind::kNot;
    EXPECT_EQ(how[i], expected) << view.name;
  }
  EXPECT_STREQ(NameOf(HoldOutKind::kBlock), "block");
}

TEST(HeldOutKindsTest, ShotsAreBlocksAndPhotosAreNot) {
  Scene film = SceneOf(1, 30, /*film=*/true);
  for (int t = 10; t < 20; ++t) film.views[t].held_out = true;  // a whole shot
  ASSERT_FALSE(film.capture().is_reconstructed);
  EXPECT_EQ(HeldOutKinds(film)[12], HoldOutKind::kBlock);
  Scene photos = SceneOf(1, 8);
  for (View& view : photos.views) view.moment.reset();
  photos.views[0].held_out = true;
  EXPECT_EQ(HeldOutKinds(photos)[0], HoldOutKind::kNot);
}

}  // namespace
}  // namespace color3d
