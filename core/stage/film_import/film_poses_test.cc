// Poses of synthetic films, estimated by COLMAP.
#include "core/stage/film_import/film_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/film/moving_regions.h"
#include "core/stage/film_import/import_film.h"
#include "core/stage/run_stages.h"
#include "tests/support/scenes/test_scenes.h"
#include "tests/support/scenes/textured_corner.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int kFrames = 16;
const Camera kCamera{400, 300, 420.0, 420.0, 200.0, 150.0};

Pose PoseOf(int frame, double step) {
  const double t = frame - 0.5 * kFrames;
  return LookAt({0.5 + step * t, -0.1 + 0.5 * step * std::sin(0.4 * t), -1.3 + 0.3 * step * t},
                {0.1, 0.4, 1.6});
}
MovingBoard BoardOf(int frame, double step) {
  const double t = frame - 0.5 * kFrames;
  return {{0.3 - step * t, 0.3 - 0.8 * step * t, 0.9}};
}

class FilmPosesTest : public StageTest {
 protected:
  void SetUp() override {
    if (!fs::exists("/usr/bin/colmap") && !fs::exists("/usr/local/bin/colmap")) {
      GTEST_SKIP() << "colmap is not installed";
    }
    film_.poses = FilmPoses::kAuto;
  }
  static std::string Name(int frame) { return "n" + std::to_string(100 + frame) + ".png"; }
  void Write(int frame, const Image& image) {
    fs::create_directories(scratch_.path() / "frames");
    WriteFileAtomic(scratch_.path() / "frames" / Name(frame), EncodePng8(image));
  }
  void WriteFilm(double camera_step, double board_step) {
    for (int i = 0; i < kFrames; ++i) {
      Write(i, RenderCorner(kCamera, PoseOf(i, camera_step), BoardOf(i, board_step)));
    }
  }
  Scene Import() {
    StageContext context = MakeContext();
    RunImportScene(options_, context, {}, film_);
    facts_ = ImportFactsFromJson(ReadFile(scratch_.path() / "out/import.json"));
    return SceneFromJson(ReadFile(scratch_.path() / "out/scene.json"));
  }

  ImportOptions options_;
  FilmOptions film_;
  ImportFacts facts_;
};

TEST_F(FilmPosesTest, FindsPosesDespiteMovingObjects) {
  WriteFilm(0.05, 0.025);
  Write(5, Image(400, 300, 1, 0.3f));  // a blank frame gets no pose
  options_.hold_out_every_eighth = true;
  const Scene scene = Import();
  ASSERT_TRUE(scene.capture().is_dynamic);
  ASSERT_EQ(scene.views.size(), kFrames - 1u) << observer_.text;
  EXPECT_THAT(observer_.text, HasSubstr("1 frame of 16 without a pose, left out: n105.png"));
  EXPECT_EQ(scene.HeldOutViews(), (std::vector<int>{4, 12}));
  EXPECT_GT(scene.points.size(), 200u);
  EXPECT_TRUE(fs::exists(scratch_.path() / "out/sfm.log"));

  ASSERT_TRUE(facts_.film.has_value());
  EXPECT_TRUE(facts_.film->poses_found);
  EXPECT_EQ(facts_.film->frames_placed, kFrames - 1);
  EXPECT_FALSE(facts_.film->camera_stands_still);
  EXPECT_NEAR(facts_.film->motion_energy, 0.08, 0.05);
  EXPECT_EQ(facts_.photos_found, kFrames);
  EXPECT_EQ(facts_.photos_registered, kFrames - 1);

  Eigen::Matrix3Xd found(3, kFrames - 1), expected(3, kFrames - 1);
  double both = 0.0, either = 0.0;
  for (int i = 0, at = 0; i < kFrames; ++i) {
    if (i == 5) continue;
    const View& view = scene.views[at];
    EXPECT_EQ(view.name, Name(i));
    EXPECT_EQ(view.image_file, "frames/" + Name(i));
    EXPECT_EQ(view.mask_file, "");
    EXPECT_NEAR(view.moment->time_s, 0.04 * i, 1e-9);
    EXPECT_NEAR(view.camera.fx, 420.0, 40.0);
    found.col(at) = view.cam_from_world.Center();
    expected.col(at++) = PoseOf(i, 0.05).Center();
    const Image moving = ReadImage(scratch_.path() / "out/moving" / Name(i));
    const Image truth = MaskOfBoard(kCamera, PoseOf(i, 0.05), BoardOf(i, 0.025));
    ASSERT_EQ(moving.data.size(), truth.data.size());
    for (size_t p = 0; p < truth.data.size(); ++p) {
      both += truth.data[p] > 0.5f && moving.data[p] > 0.5f;
      either += truth.data[p] > 0.5f || moving.data[p] > 0.5f;
    }
  }
  EXPECT_GT(both / either, 0.6);
  const Eigen::Matrix4d align = Eigen::umeyama(found, expected);
  for (int i = 0; i < kFrames - 1; ++i) {
    const Eigen::Vector3d aligned = (align * found.col(i).homogeneous()).head<3>();
    EXPECT_LT((aligned - expected.col(i)).norm(), 0.03) << i;  // the path is 0.75 long
  }
}

TEST_F(FilmPosesTest, MakesReliefOfStandingCamera) {
  WriteFilm(0.0, 0.025);
  options_.hold_out_every_eighth = true;
  const Scene scene = Import();
  ASSERT_TRUE(scene.relief.has_value());
  EXPECT_TRUE(scene.capture().is_dynamic);
  EXPECT_EQ(scene.views.size(), static_cast<size_t>(kFrames));
  EXPECT_EQ(scene.HeldOutViews(), (std::vector<int>{4, 12}));
  EXPECT_THAT(observer_.text, HasSubstr("the camera stands still"));
  EXPECT_THAT(observer_.text, HasSubstr("a relief (2.5D) with assumed depth"));
  EXPECT_TRUE(facts_.film->camera_stands_still);
  EXPECT_TRUE(facts_.film->poses_found);
  EXPECT_GT(facts_.film->motion_energy, 0.03);
  EXPECT_FALSE(facts_.ran_structure_from_motion);
  EXPECT_FALSE(fs::exists(scratch_.path() / "out/sfm.log"));

  EXPECT_GT(scene.points.size(), 10'000u);
  const Camera& camera = scene.views[0].camera;
  for (const SparsePoint& point : scene.points) {
    const Eigen::Vector2d pixel = camera.Project(point.position);
    ASSERT_TRUE(camera.Contains(pixel));
    ASSERT_NEAR(point.position.z(), scene.relief->Depth(pixel.y() / camera.height), 1e-9);
  }
  for (int i = 0; i < kFrames; ++i) {
    const Image moving = ReadImage(scratch_.path() / "out/moving" / Name(i));
    const double foot = LowestMovingRow(moving);
    EXPECT_GT(foot, scene.relief->foot) << "the board stands in front of the backdrop";
  }
}

TEST_F(FilmPosesTest, KeepsCutOrUntexturedFilmWithoutPoses) {
  for (int i = 0; i < 12; ++i) {
    Random random(static_cast<uint64_t>(i < 6 ? 1 : 2));
    Image noise(40, 30, 1);
    for (float& v : noise.data) v = static_cast<float>(random.NextUniform());
    Write(i, Resize(noise, 400, 300));
  }
  EXPECT_FALSE(Import().capture().is_reconstructed);
  EXPECT_THAT(observer_.text, HasSubstr("its longest shot has 6 of 12 frames"));
  EXPECT_LT(facts_.film->motion_energy, 0.0);

  observer_.text.clear();
  fs::remove_all(scratch_.path() / "frames");
  for (int i = 0; i < 4; ++i) {  // without texture
    Write(i, GradientPhoto(400, 300, 1));
  }
  EXPECT_FALSE(Import().capture().is_reconstructed);
  EXPECT_THAT(observer_.text, HasSubstr("stays without poses: none of 4 frames could be placed"));
  EXPECT_FALSE(facts_.film->poses_found);
}

TEST_F(FilmPosesTest, KeepsFilmOnTimeoutButNotWhenCancelled) {
  WriteFilm(0.05, 0.025);
  options_.sfm_timeout = std::chrono::seconds(1);
  EXPECT_FALSE(Import().capture().is_reconstructed);
  EXPECT_THAT(observer_.text, HasSubstr("the film stays without poses"));
  cancel_.Cancel();
  EXPECT_THAT(Refusal([&] { Import(); }), HasSubstr("cancelled"));
}

}  // namespace
}  // namespace color3d
