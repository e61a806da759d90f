// Readers against real COLMAP models; skipped when the data is absent (colmap_test.cc and
// transforms_test.cc check the same on made-up scenes).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/scene/formats/colmap_model.h"
#include "core/scene/formats/scene_readers.h"
#include "core/scene/import/import.h"
#include "core/scene/lens.h"
#include "core/scene/view_images.h"
#include "tests/support/quiet_run.h"
#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

class RealScenes : public testing::TestWithParam<const char*> {
 protected:
  fs::path Folder(const std::string& name) const {
    return fs::path(COLOR3D_SHARED_DATA) / "scenes" / name;
  }
};

TEST_P(RealScenes, PointsReprojectToStoredObservations) {
  const fs::path folder = Folder(GetParam());
  if (!fs::exists(folder / "sparse/0")) GTEST_SKIP() << "no " << folder;
  const Scene scene = ReadColmapModel(folder / "sparse/0", folder);
  const ColmapModel model = LoadColmapModel(folder / "sparse/0");
  ASSERT_EQ(scene.views.size(), model.images.size());
  ASSERT_EQ(scene.points.size(), model.points.size());
  std::map<std::pair<std::string, int64_t>, std::vector<Eigen::Vector2d>> seen_at;
  for (const auto& [id, image] : model.images) {
    for (const auto& o : image.observations) {
      if (o.point_id >= 0) seen_at[{image.name, o.point_id}].push_back(o.pixel);
    }
  }

  // COLMAP stores each point's mean distance to its observations: ours must be the same number.
  double sum = 0.0, worst_error = 0.0, worst_undistorted = 0.0;
  size_t observations = 0;
  for (size_t i = 0; i < scene.points.size(); ++i) {
    const SparsePoint& point = scene.points[i];
    double point_sum = 0.0;
    for (int v : point.views) {
      const View& view = scene.views[v];
      const Eigen::Vector3d p = view.cam_from_world.Apply(point.position);
      ASSERT_GT(p.z(), 0.0);
      const Eigen::Vector2d pixel = ProjectCaptured(view.captured_camera, view.distortion, p);
      double best = 1e9;  // a point may have two observations in one image
      for (const Eigen::Vector2d& seen : seen_at[{view.name, model.points[i].id}]) {
        best = std::min(best, (seen - pixel).norm());
      }
      point_sum += best;
      // Undistorting the pixel that the photo shows must give the pinhole projection: invert the
      // lens numerically and project again.
      const Eigen::Vector2d target = view.captured_camera.Ray(pixel.x(), pixel.y()).head<2>();
      Eigen::Vector2d ray = target;
      for (int k = 0; k < 50; ++k) ray += target - Distort(view.distortion, ray);
      const Eigen::Vector2d pinhole = view.camera.Project(p);
      const Eigen::Vector2d undistorted = view.camera.Project(ray.homogeneous());
      worst_undistorted = std::max(worst_undistorted, (pinhole - undistorted).norm());
    }
    sum += point_sum;
    observations += point.views.size();
    if (model.points[i].image_ids.size() == point.views.size()) {
      worst_error = std::max(worst_error,
                             std::abs(point_sum / static_cast<double>(point.views.size()) -
                                      point.reprojection_error_px));
    }
  }
  std::printf(
      "%s: %zu observations, mean distance %.3f px, worst departure from the stored error "
      "%.2g px\n",
      GetParam(),
      observations,
      sum / static_cast<double>(observations),
      worst_error);
  EXPECT_LT(sum / static_cast<double>(observations), 1.0);
  EXPECT_LT(worst_error, 1e-9);
  EXPECT_LT(worst_undistorted, 1e-3);
}

TEST_P(RealScenes, ImportIsQuickAndSane) {
  const fs::path folder = Folder(GetParam());
  if (!fs::exists(folder / "sparse/0")) GTEST_SKIP() << "no " << folder;
  const ScratchFolder scratch;
  QuietRun run;
  ImportOptions options;
  options.hold_out_every_eighth = true;
  const ImportResult result = ImportScene(folder, scratch.path(), options, run.control());
  EXPECT_EQ(result.layout, CaptureLayout::kColmap);
  EXPECT_TRUE(result.undistorted);
  EXPECT_FALSE(result.ran_structure_from_motion);
  EXPECT_EQ(result.scene.HeldOutViews().size(), (result.scene.views.size() + 7) / 8);
  for (const View& view : result.scene.views) {
    const double zoom = view.camera.fx / view.captured_camera.fx;
    EXPECT_GT(zoom, 0.8) << view.name;
    EXPECT_LT(zoom, 1.25) << view.name;
  }
  const Scene again = SceneFromJson(SceneToJson(result.scene));
  EXPECT_EQ(again.points.size(), result.scene.points.size());
  const ViewImages images(result.scene, folder, 400);
  const auto luminance = images.Luminance(0);
  EXPECT_EQ(std::max(luminance->width, luminance->height), 400);
  EXPECT_EQ(images.WorkingCamera(0).width, luminance->width);
}

INSTANTIATE_TEST_SUITE_P(Shared,
                         RealScenes,
                         testing::Values("fern", "fox", "banana", "sceaux"),
                         [](const auto& info) { return std::string(info.param); });

TEST(RealTransforms, FoxHasFramesWithoutFiles) {
  const fs::path folder = fs::path(COLOR3D_SHARED_DATA) / "scenes/fox";
  if (!fs::exists(folder / "transforms.json")) GTEST_SKIP();
  const Scene transforms = ReadTransformsJson({folder / "transforms.json"}, folder);
  const Scene colmap = ReadColmapModel(folder / "sparse/0", folder);
  EXPECT_GE(transforms.views.size(), 40u);
  EXPECT_LE(transforms.views.size(), colmap.views.size());
  for (const View& view : transforms.views) {
    EXPECT_EQ(view.captured_camera.width, 567);
    EXPECT_EQ(view.captured_camera.height, 1008);
    EXPECT_EQ(view.distortion.model, Distortion::Model::kBrown);
  }
  // Two independent sets of poses of the same photos: relative rotations must agree.
  const View& t0 = transforms.views[0];
  const View& c0 = colmap.views[colmap.FindView(t0.name)];
  double worst_deg = 0.0;
  for (const View& t : transforms.views) {
    const View& c = colmap.views[colmap.FindView(t.name)];
    const Eigen::Quaterniond from_t =
        t.cam_from_world.rotation * t0.cam_from_world.rotation.conjugate();
    const Eigen::Quaterniond from_c =
        c.cam_from_world.rotation * c0.cam_from_world.rotation.conjugate();
    worst_deg = std::max(worst_deg, from_t.angularDistance(from_c) * 180.0 / M_PI);
  }
  std::printf("fox: worst relative rotation between the two pose sets %.2f degrees\n", worst_deg);
  EXPECT_LT(worst_deg, 3.0);
}

}  // namespace
}  // namespace color3d
