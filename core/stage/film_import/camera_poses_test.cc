// Poses of the cameras of synthetic films, estimated by COLMAP.
#include "core/stage/film_import/camera_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "core/stage/film_import/import_film.h"
#include "core/stage/run_stages.h"
#include "core/video/mp4_writer.h"
#include "tests/support/scenes/test_scenes.h"
#include "tests/support/scenes/textured_corner.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int kFrames = 6;
const Camera kFirst{400, 300, 420.0, 420.0, 200.0, 150.0};
const Camera kSecond{360, 300, 380.0, 380.0, 180.0, 150.0};

// Two cameras move along different paths, and one stands still.
Pose PoseOf(const std::string& camera, int frame) {
  const double t = frame - 0.5 * kFrames;
  if (camera == "left") return LookAt({0.4 + 0.08 * t, -0.1, -1.3 + 0.03 * t}, {0.1, 0.4, 1.6});
  if (camera == "right") return LookAt({0.8, -0.3 + 0.06 * t, -1.2 + 0.06 * t}, {0.1, 0.4, 1.6});
  return LookAt({0.1, 0.0, -1.0}, {0.1, 0.4, 1.6});
}
Camera LensOf(const std::string& camera) { return camera == "right" ? kSecond : kFirst; }
MovingBoard BoardAt(int frame) { return {{0.3 - 0.08 * frame, 0.3, 0.9}}; }

class CameraPosesTest : public StageTest {
 protected:
  void SetUp() override {
    if (!fs::exists("/usr/bin/colmap") && !fs::exists("/usr/local/bin/colmap")) {
      GTEST_SKIP() << "colmap is not installed";
    }
  }
  static std::string Name(int frame) { return "n" + std::to_string(100 + frame) + ".png"; }
  void Write(const std::string& camera, int frame, const Image& image) {
    const fs::path folder = scratch_.path() / "frames" / camera;
    fs::create_directories(folder);
    WriteFileAtomic(folder / Name(frame), EncodePng8(image));
  }
  void WriteFilm(const std::string& camera) {
    for (int i = 0; i < kFrames; ++i) {
      Write(camera, i, RenderCorner(LensOf(camera), PoseOf(camera, i), BoardAt(i)));
    }
  }
  Scene Import() {
    fs::remove_all(scratch_.path() / "out");
    StageContext context = MakeContext();
    RunImportScene(options_, context, {}, film_);
    facts_ = ImportFactsFromJson(ReadFile(scratch_.path() / "out/import.json"));
    return SceneFromJson(ReadFile(scratch_.path() / "out/scene.json"));
  }

  ImportOptions options_{.sfm_max_features = 1024};
  FilmOptions film_;
  ImportFacts facts_;
};

TEST_F(CameraPosesTest, FindsPosesAndLeavesOutUnrelatedCamera) {
  for (const char* camera : {"left", "right", "stand"}) WriteFilm(camera);
  for (int i = 0; i < kFrames; ++i) {
    const Pose elsewhere = LookAt({9.0 + 0.1 * i, -4.0, -8.0}, {12.0, -3.5, 2.0});
    Write("elsewhere", i, RenderCorner(kFirst, elsewhere));
  }
  film_.frames_per_second = 10.0;
  options_.hold_out_camera = "right";
  const Scene scene = Import();
  ASSERT_TRUE(scene.capture().is_dynamic);
  ASSERT_EQ(scene.views.size(), 3u * kFrames) << observer_.text;
  EXPECT_EQ(scene.views[kFrames + 3].name, "right/n103.png");
  EXPECT_EQ(scene.views[kFrames + 3].image_file, "frames/right/n103.png");
  EXPECT_NEAR(scene.views[kFrames + 3].moment->time_s, 0.3, 1e-9);
  EXPECT_EQ(scene.views[kFrames + 3].moment->shot, 1);
  EXPECT_EQ(scene.HeldOutViews().size(), static_cast<size_t>(kFrames));
  EXPECT_TRUE(fs::exists(scratch_.path() / "out/sfm.log"));
  EXPECT_THAT(observer_.text,
              HasSubstr("have a pose relative to frames/left, frames/right, frames/stand: "
                        "frames/elsewhere (0 %)"));
  for (int i = 0; i < kFrames; ++i) {
    EXPECT_TRUE(fs::exists(scratch_.path() / "out/moving/left" / Name(i))) << i;
  }
  EXPECT_EQ(facts_.layout, CaptureLayout::kFilms);
  EXPECT_TRUE(facts_.film->poses_found);
  EXPECT_EQ(facts_.film->frames_placed, 3 * kFrames);
  EXPECT_GT(facts_.film->motion_energy, 0.02);
  ASSERT_EQ(facts_.cameras.size(), 3u);
  EXPECT_THAT(facts_.sfm_plan, HasSubstr("across cameras"));

  Eigen::Matrix3Xd found(3, scene.views.size()), expected(3, scene.views.size());
  for (size_t i = 0; i < scene.views.size(); ++i) {
    const std::string camera = fs::path(scene.views[i].name).parent_path().string();
    found.col(i) = scene.views[i].cam_from_world.Center();
    expected.col(i) = PoseOf(camera, static_cast<int>(i) % kFrames).Center();
    EXPECT_NEAR(scene.views[i].camera.fx / LensOf(camera).fx, 1.0, 0.1) << camera;
  }
  const Eigen::Matrix4d align = Eigen::umeyama(found, expected);
  for (size_t i = 0; i < scene.views.size(); ++i) {
    const Eigen::Vector3d aligned = (align * found.col(i).homogeneous()).head<3>();
    EXPECT_LT((aligned - expected.col(i)).norm(), 0.04) << scene.views[i].name;
  }
  // All frames of the standing camera observe the same points.
  for (const SparsePoint& point : scene.points) {
    int standing = 0;
    for (const int view : point.views) standing += view >= 2 * kFrames;
    EXPECT_TRUE(standing == 0 || standing == kFrames) << standing;
  }
}

TEST_F(CameraPosesTest, AppliesTimeOffsetsOfVideos) {
  ThreadPool pool(1);
  for (const std::string camera : {"left", "right"}) {
    const Camera lens = LensOf(camera);
    Mp4Writer writer(scratch_.path() / (camera + ".mp4"),
                     {.width = lens.width, .height = lens.height, .frames_per_second = 10});
    for (int i = 0; i < kFrames; ++i) {
      const Image gray = RenderCorner(lens, PoseOf(camera, i), BoardAt(i));
      Image srgb(gray.width, gray.height, 3);
      for (int c = 0; c < 3; ++c) std::copy(gray.data.begin(), gray.data.end(), srgb.Plane(c));
      writer.Add(srgb, pool);
    }
    writer.Finish();
  }
  WriteFileAtomic(scratch_.path() / "transforms.json",
                  R"({"frames":[{"file_path":"left.mp4"},
                                {"file_path":"right.mp4","time_offset":0.2}]})");
  const Scene scene = Import();
  ASSERT_EQ(scene.views.size(), 2u * kFrames) << observer_.text;
  const View& view = scene.views[kFrames + 1];
  EXPECT_EQ(view.name, "right/f000001.png");
  EXPECT_NEAR(view.moment->time_s, 0.3, 1e-6);
  EXPECT_EQ(view.moment->time_s, scene.views[3].moment->time_s);
  EXPECT_EQ(ReadImage(scratch_.path() / "out" / view.image_file).width, kSecond.width);
  EXPECT_EQ(facts_.cameras[1].film, "right.mp4");
}

TEST_F(CameraPosesTest, RefusesUnrelatedCamerasAndCuts) {
  WriteFilm("left");
  for (int i = 0; i < kFrames; ++i) Write("flat", i, GradientPhoto(400, 300, 1));
  EXPECT_THAT(Refusal([&] { Import(); }), HasSubstr("colour each film on its own"));
  // A cut in one of them.
  for (int i = 0; i < kFrames; ++i) {
    Random random(static_cast<uint64_t>(i < 3 ? 1 : 2));
    Image noise(40, 30, 1);
    for (float& v : noise.data) v = static_cast<float>(random.NextUniform());
    Write("flat", i, Resize(noise, 400, 300));
  }
  EXPECT_THAT(Refusal([&] { Import(); }), HasSubstr("frames/flat has a cut before flat/n103.png"));
}

TEST_F(CameraPosesTest, RefusesPicturesBesideFolders) {
  for (const char* camera : {"left", "right"}) WriteFilm(camera);
  WriteFileAtomic(scratch_.path() / "frames/lost.png", EncodePng8(Image(40, 30, 1, 0.5f)));
  EXPECT_THAT(Refusal([&] { Import(); }), HasSubstr("frames/lost.png lies beside the folder"));
}

}  // namespace
}  // namespace color3d
