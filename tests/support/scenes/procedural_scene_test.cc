#include "tests/support/scenes/procedural_scene.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/progress.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/import/import.h"
#include "tests/support/quiet_run.h"

namespace color3d {
namespace {

ProceduralSceneOptions Small() {
  ProceduralSceneOptions options;
  options.views = 6;
  options.width = 96;
  options.height = 72;
  options.sparse_points = 300;
  options.supersampling = 2;
  return options;
}

Eigen::Vector2d Project(const View& view, const Eigen::Vector3d& point) {
  return view.camera.Project(view.cam_from_world.Apply(point));
}

double StandardDeviation(const Image& plane) {
  double sum = 0.0, squares = 0.0;
  for (float v : plane.data) sum += v, squares += static_cast<double>(v) * v;
  const double n = static_cast<double>(plane.data.size());
  return std::sqrt(std::max(0.0, squares / n - (sum / n) * (sum / n)));
}

TEST(ProceduralScene, PicturesAreTexturedColoredAndNotClipped) {
  const ProceduralScene room(Small());
  const Image srgb = room.RenderSrgb(2);
  EXPECT_GT(Colorfulness(srgb), 20.0);
  const Image luminance = LuminanceFromSrgb(srgb);
  EXPECT_GT(StandardDeviation(luminance), 8.0);
  size_t extreme = 0;
  for (float v : srgb.data) extreme += v <= 0.0f || v >= 1.0f;
  EXPECT_LT(extreme, srgb.data.size() / 50);
}

TEST(ProceduralScene, PointsLieOnTheDepthOfTheirViews) {
  const ProceduralScene room(Small());
  ASSERT_EQ(room.scene().points.size(), 300u);
  const Image depth = room.RenderDepth(3);
  int checked = 0, close = 0;
  for (const SparsePoint& point : room.scene().points) {
    EXPECT_GE(point.views.size(), 3u);
    if (std::find(point.views.begin(), point.views.end(), 3) == point.views.end()) continue;
    const View& view = room.scene().views[3];
    const Eigen::Vector2d pixel = Project(view, point.position);
    const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
    const double z = view.cam_from_world.Apply(point.position).z();
    ++checked;
    close += std::abs(depth.At(0, y, x) - z) < 0.05 * z;
  }
  EXPECT_GT(checked, 100);
  EXPECT_GT(close, 0.9 * checked);  // depth edges within a pixel differ
}

TEST(ProceduralScene, PointsHaveOneColorInAllViews) {
  ProceduralSceneOptions options = Small();
  options.width = 320;
  options.height = 240;
  const ProceduralScene room(options);
  const Image a = LabFromSrgb(room.RenderSrgb(2)), b = LabFromSrgb(room.RenderSrgb(3));
  double sum = 0.0, shuffled = 0.0;
  int count = 0;
  for (const SparsePoint& point : room.scene().points) {
    const Eigen::Vector2d pa = Project(room.scene().views[2], point.position);
    const Eigen::Vector2d pb = Project(room.scene().views[3], point.position);
    const bool seen = std::count(point.views.begin(), point.views.end(), 2) +
                          std::count(point.views.begin(), point.views.end(), 3) ==
                      2;
    if (!seen) continue;
    const auto at = [](const Image& image, const Eigen::Vector2d& p) {
      const int x = static_cast<int>(p.x()), y = static_cast<int>(p.y());
      return LabColor{image.At(0, y, x), image.At(1, y, x), image.At(2, y, x)};
    };
    sum += DeltaE00(at(a, pa), at(b, pb));
    shuffled += DeltaE00(at(a, pa), at(b, {319.0 - pb.x(), pb.y()}));
    ++count;
  }
  ASSERT_GT(count, 100);
  EXPECT_LT(sum / count, 4.0);
  EXPECT_GT(shuffled, 3.0 * sum);
}

TEST(ProceduralScene, WrittenSceneIsReadBackWithItsPoses) {
  const ScratchFolder folder;
  QuietRun run;
  for (const auto poses :
       {ProceduralSceneOptions::Poses::kColmap, ProceduralSceneOptions::Poses::kTransforms}) {
    ProceduralSceneOptions options = Small();
    options.poses = poses;
    const auto path = folder.path() / (poses == ProceduralSceneOptions::Poses::kColmap ? "c" : "t");
    WriteProceduralScene(path, options);
    const ImportResult result = ImportScene(path, folder.path() / "scratch", {}, run.control());
    ASSERT_EQ(result.scene.views.size(), 6u);
    const ProceduralScene room(options);
    for (int i = 0; i < 6; ++i) {
      const View& expected = room.scene().views[i];
      const View& got = result.scene.views[i];
      EXPECT_EQ(got.name.substr(got.name.rfind('/') + 1), expected.name);
      const Eigen::Vector3d center = got.cam_from_world.Center() + result.scene.world_offset;
      EXPECT_LT((center - expected.cam_from_world.Center()).norm(), 1e-9);
      EXPECT_NEAR(got.camera.fx, expected.camera.fx, 1e-9);
    }
  }
}

TEST(ProceduralScene, GrayPhotosKeepTheLuminanceOfTheTruth) {
  const ScratchFolder folder;
  ProceduralSceneOptions options = Small();
  options.views = 1;
  options.gray = true;
  WriteProceduralScene(folder.path(), options);
  const Image gray = ReadImage(folder.path() / "images/view000.png");
  const Image truth = ReadImage(folder.path() / "truth/view000.png");
  ASSERT_EQ(gray.channels, 1);
  ASSERT_EQ(truth.channels, 3);
  const Image l_gray = LuminanceFromSrgb(gray), l_truth = LuminanceFromSrgb(truth);
  double worst = 0.0;
  for (size_t i = 0; i < l_gray.data.size(); ++i) {
    worst = std::max<double>(worst, std::abs(l_gray.data[i] - l_truth.data[i]));
  }
  EXPECT_LT(worst, 0.6);  // both are rounded to 8 bits
}

TEST(ProceduralScene, SameSeedSamePixelsAnotherSeedAnotherRoom) {
  ProceduralSceneOptions options = Small();
  options.threads = 1;
  const Image first = ProceduralScene(options).RenderSrgb(0);
  options.threads = 3;
  EXPECT_EQ(ProceduralScene(options).RenderSrgb(0).data, first.data);
  options.seed = 2;
  EXPECT_NE(ProceduralScene(options).RenderSrgb(0).data, first.data);
  options.views = 0;
  EXPECT_THROW(options.Validate(), Error);
}

}  // namespace
}  // namespace color3d
