#include "core/scene/masks/still_regions.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/scene/lens.h"

namespace color3d {
namespace {

Scene SceneOf(const std::filesystem::path& folder, double distortion) {
  View view;
  view.name = view.image_file = "a.png";
  view.camera = view.captured_camera = {80, 60, 70.0, 70.0, 40.0, 30.0};
  if (distortion != 0.0) {
    view.distortion.model = Distortion::Model::kBrown;
    view.distortion.k[0] = distortion;
    view.camera = UndistortedCamera(view.captured_camera, view.distortion);
  }
  WriteFileAtomic(folder / "a.png", EncodePng8(Image(80, 60, 3, 0.5f)));
  Scene scene;
  scene.views.push_back(view);
  return scene;
}

// 16 x 12 px, with a moving block of 4 x 3 px near a corner.
Image Moving() {
  Image moving(16, 12, 1);
  for (int y = 1; y < 4; ++y) {
    for (int x = 1; x < 5; ++x) moving.At(0, y, x) = 1.0f;
  }
  return moving;
}

TEST(StillRegionTest, LeavesOutMovingObjects) {
  const ScratchFolder scratch;
  const Scene scene = SceneOf(scratch.path(), 0.0);
  const Image still = StillRegion(ViewImages(scene, scratch.path(), 40), scene, 0, Moving());
  ASSERT_EQ(still.width, 40);
  ASSERT_EQ(still.height, 30);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      // 5 px of the frame, 2.5 working px, for each px of the region.
      const bool moves = 2 * x + 2 > 5 && 2 * x < 25 && 2 * y + 2 > 5 && 2 * y < 20;
      ASSERT_EQ(still.At(0, y, x), moves ? 0.0f : 1.0f) << x << ", " << y;
    }
  }
}

TEST(StillRegionTest, FollowsLensDistortion) {
  const ScratchFolder scratch;
  const Scene scene = SceneOf(scratch.path(), -0.3);
  const View& view = scene.views[0];
  const Image still = StillRegion(ViewImages(scene, scratch.path(), 80), scene, 0, Moving());
  int moving = 0;
  for (int y = 0; y < still.height; ++y) {
    for (int x = 0; x < still.width; ++x) {
      const Eigen::Vector2d at =
          ProjectCaptured(view.captured_camera, view.distortion, view.camera.Ray(x + 0.5, y + 0.5));
      const double inside = std::min({at.x() - 5.0, 25.0 - at.x(), at.y() - 5.0, 20.0 - at.y()});
      if (inside > 0.0) {
        ASSERT_EQ(still.At(0, y, x), 0.0f) << x << ", " << y;
      } else if (inside < -2.0) {
        ASSERT_EQ(still.At(0, y, x), 1.0f) << x << ", " << y;
      }
      moving += still.At(0, y, x) == 0.0f;
    }
  }
  EXPECT_GT(moving, 50);
}

}  // namespace
}  // namespace color3d
