#include "core/scene/view_images.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "core/color/lab.h"
#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

const Distortion kBarrel{Distortion::Model::kBrown, {-0.2, 0.03, 2e-3, -1e-3}};

// A photo whose channels are its own pixel coordinates: undistorting it gives, at every pixel, the
// place that the pixel came from.
Image CoordinatePhoto(int width, int height) {
  Image image(width, height, 2);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.At(0, y, x) = static_cast<float>(x + 0.5);
      image.At(1, y, x) = static_cast<float>(y + 0.5);
    }
  }
  return image;
}

TEST(ViewImages, UndistortionMatchesPinholeProjection) {
  for (const Distortion& distortion :
       {kBarrel, Distortion{Distortion::Model::kFisheye, {0.02, -0.01}}}) {
    Scene scene = ArcScene(2, distortion);
    for (View& view : scene.views) {
      view.captured_camera = {320, 240, 260.0, 265.0, 163.0, 118.0};
      view.camera = UndistortedCamera(view.captured_camera, distortion);
    }
    for (int side : {0, 160, 100}) {
      const ViewImages images(scene, "", side);
      const Camera working = images.WorkingCamera(0);
      const Image from = images.Undistort(0, CoordinatePhoto(320, 240));
      ASSERT_EQ(from.width, working.width);
      ASSERT_EQ(from.height, working.height);
      // Every sparse point: where the pinhole camera sees it, the picture must hold the pixel at
      // which the photo, through its lens, saw it.
      int checked = 0;
      for (const SparsePoint& point : scene.points) {
        const Eigen::Vector3d p = scene.views[0].cam_from_world.Apply(point.position);
        const Eigen::Vector2d pixel = working.Project(p);
        const Eigen::Vector2d seen = ProjectCaptured(scene.views[0].captured_camera, distortion, p);
        const int x = static_cast<int>(std::floor(pixel.x() - 0.5));
        const int y = static_cast<int>(std::floor(pixel.y() - 0.5));
        if (x < 2 || y < 2 || x + 3 >= working.width || y + 3 >= working.height) continue;
        const double fx = pixel.x() - 0.5 - x;
        const double fy = pixel.y() - 0.5 - y;
        for (int c = 0; c < 2; ++c) {
          const double value =
              (1 - fy) * ((1 - fx) * from.At(c, y, x) + fx * from.At(c, y, x + 1)) +
              fy * ((1 - fx) * from.At(c, y + 1, x) + fx * from.At(c, y + 1, x + 1));
          EXPECT_NEAR(value, seen[c], side == 0 ? 0.002 : 0.03) << "side " << side;
        }
        ++checked;
      }
      EXPECT_GT(checked, 30);
    }
  }
}

TEST(ViewImages, KeepsUndistortedPhotoAtFullSize) {
  const ScratchFolder folder;
  const Scene scene = ArcScene(2);
  WritePhotos(scene, folder.path());
  const ViewImages images(scene, folder.path(), 0);
  const Image photo = ReadImage(folder.path() / "images/0001.png");
  EXPECT_EQ(images.Srgb(0).data.size(), 3 * photo.data.size());
  EXPECT_TRUE(std::equal(photo.data.begin(), photo.data.end(), images.Srgb(0).data.begin()));
  EXPECT_EQ(images.Luminance(0)->data, LuminanceFromSrgb(photo).data);
}

TEST(ViewImages, LuminanceIsThatOfSrgb) {
  const ScratchFolder folder;
  Scene scene = ArcScene(1, kBarrel);
  std::filesystem::create_directories(folder.path() / "images");
  WriteFileAtomic(folder.path() / "images/0001.png", EncodePng16(GradientPhoto(48, 32, 3)));
  const ViewImages images(scene, folder.path(), 24);
  const Image srgb = images.Srgb(0);
  ASSERT_EQ(srgb.channels, 3);
  ASSERT_EQ(srgb.width, 24);
  EXPECT_EQ(images.Luminance(0)->data, LuminanceFromSrgb(srgb).data);
}

TEST(ViewImages, RefusesWrongSizesAndNumbers) {
  const ScratchFolder folder;
  const Scene scene = ArcScene(1);
  std::filesystem::create_directories(folder.path() / "images");
  WriteFileAtomic(folder.path() / "images/0001.png", EncodePng8(GradientPhoto(40, 32, 1)));
  const ViewImages images(scene, folder.path(), 0);
  EXPECT_THAT(Refusal([&] { images.Luminance(0); }), HasSubstr("48 x 32 px"));
  EXPECT_THAT(Refusal([&] { images.Luminance(0); }), HasSubstr("40 x 32 px"));
  EXPECT_THAT(Refusal([&] { images.Undistort(0, Image(3, 4, 1)); }), HasSubstr("3 x 4 px"));
  EXPECT_THAT(Refusal([&] { images.Luminance(1); }), HasSubstr("view 1 does not exist"));
  EXPECT_THAT(Refusal([&] { images.WorkingCamera(-1); }), HasSubstr("view -1 does not exist"));
}

TEST(ViewImages, CacheStaysWithinBudget) {
  const ScratchFolder folder;
  const Scene scene = ArcScene(6);
  WritePhotos(scene, folder.path());
  const int64_t picture = 48 * 32 * 4;
  const ViewImages images(scene, folder.path(), 0, 2 * picture);
  const std::weak_ptr<const Image> first = images.Luminance(0);
  const std::weak_ptr<const Image> second = images.Luminance(1);
  EXPECT_FALSE(first.expired());
  EXPECT_EQ(images.Luminance(0), first.lock());  // from the cache, and now the most recently used
  images.Luminance(2);
  EXPECT_FALSE(first.expired());
  EXPECT_TRUE(second.expired());
  images.Luminance(3);
  EXPECT_TRUE(first.expired());
  const ViewImages none(scene, folder.path(), 0, 0);
  const std::weak_ptr<const Image> uncached = none.Luminance(0);
  EXPECT_TRUE(uncached.expired());
}

TEST(ViewImages, ThreadsGetSamePictures) {
  const ScratchFolder folder;
  const Scene scene = ArcScene(8, kBarrel);
  WritePhotos(scene, folder.path());
  const ViewImages reference(scene, folder.path(), 24);
  const ViewImages images(scene, folder.path(), 24, 3 * 24 * 16 * 4);
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 100; ++i) {
        const int view = (i * 7 + t * 3) % 8;
        if (images.Luminance(view)->data != reference.Luminance(view)->data) ++wrong;
      }
    });
  }
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace color3d
