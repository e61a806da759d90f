// Structure-from-motion end to end: COLMAP on rendered photos of a textured room corner whose
// camera positions are known, and on a real photo series if it is available.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <thread>

#include "core/scene/formats/scene_readers.h"
#include "core/scene/import/import.h"
#include "core/scene/sfm/parallax.h"
#include "core/scene/sfm/sfm_photos.h"
#include "tests/support/quiet_run.h"
#include "tests/support/scenes/test_exif.h"
#include "tests/support/scenes/test_scenes.h"
#include "tests/support/scenes/textured_corner.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

bool HasColmap() { return fs::exists("/usr/bin/colmap") || fs::exists("/usr/local/bin/colmap"); }

const Camera kRoomCamera{400, 300, 420.0, 420.0, 200.0, 150.0};

std::vector<Pose> RoomPoses(int count) {
  std::vector<Pose> poses;
  for (int i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / std::max(1, count - 1) - 0.5;
    poses.push_back(
        LookAt({2.0 * t + 0.6, -0.2 + 0.3 * std::sin(5.0 * t), -1.2 + 0.4 * t}, {-0.3, 0.4, 1.5}));
  }
  return poses;
}

std::string PhotoName(int i) { return "p" + std::to_string(100 + i) + ".png"; }

class Sfm : public testing::Test {
 protected:
  void SetUp() override {
    if (!HasColmap()) GTEST_SKIP() << "colmap is not installed";
  }
  ImportResult Run() {
    return ImportScene(folder_.path(), scratch_.path(), options_, run_.ReportingTo(progress_));
  }
  ScratchFolder folder_;
  ScratchFolder scratch_;
  ImportOptions options_;
  RecordingObserver progress_;
  QuietRun run_;
};

TEST_F(Sfm, FindsCamerasOfRenderedRoom) {
  const std::vector<Pose> truth = RoomPoses(7);
  for (int i = 0; i < 7; ++i) {
    Image photo = RenderCorner(kRoomCamera, truth[i]);
    if (i == 2) {  // a dull 16-bit scan
      for (float& v : photo.data) v = 0.1f + 0.15f * v;
      WriteFileAtomic(folder_.path() / PhotoName(i), EncodePng16(photo));
    } else {
      WriteFileAtomic(folder_.path() / PhotoName(i), EncodePng8(photo));
    }
  }
  const ImportResult result = Run();
  EXPECT_EQ(result.layout, CaptureLayout::kPhotos);
  EXPECT_TRUE(result.ran_structure_from_motion);
  EXPECT_EQ(result.photos_found, 7);
  ASSERT_EQ(result.photos_registered, 7);
  EXPECT_GT(result.scene.points.size(), 200u);
  EXPECT_THAT(progress_.messages, HasSubstr("finding features"));
  EXPECT_THAT(progress_.messages, HasSubstr("placing cameras"));
  EXPECT_TRUE(fs::exists(scratch_.path() / "sfm.log"));

  // Centres up to a similarity, then directions in the aligned world.
  Eigen::Matrix<double, 3, 7> found, expected;
  for (int i = 0; i < 7; ++i) {
    const View& view = result.scene.views[i];
    EXPECT_EQ(view.name, PhotoName(i));
    found.col(i) = view.cam_from_world.Center();
    expected.col(i) = truth[i].Center();
    EXPECT_NEAR(view.captured_camera.fx, 420.0, 25.0);
    EXPECT_EQ(view.captured_camera.width, 400);
  }
  const Eigen::Matrix4d align = Eigen::umeyama(found, expected);
  const double scale = std::cbrt(align.topLeftCorner<3, 3>().determinant());
  const Eigen::Matrix3d rotation = align.topLeftCorner<3, 3>() / scale;
  for (int i = 0; i < 7; ++i) {
    const Eigen::Vector3d aligned = (align * found.col(i).homogeneous()).head<3>();
    EXPECT_LT((aligned - expected.col(i)).norm(), 0.05) << i;  // the path is 2 long
    const Eigen::Vector3d looks =
        rotation *
        (result.scene.views[i].cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d should = truth[i].rotation.conjugate() * Eigen::Vector3d::UnitZ();
    EXPECT_LT(std::acos(std::min(1.0, looks.dot(should))) * 180.0 / M_PI, 2.0) << i;
  }
}

// The result depends neither on the number of threads nor on their timing.
TEST_F(Sfm, IsDeterministic) {
  const std::vector<Pose> poses = RoomPoses(6);
  for (int i = 0; i < 6; ++i) {
    WriteFileAtomic(folder_.path() / PhotoName(i),
                    EncodePng8(RenderCorner(kRoomCamera, poses[static_cast<size_t>(i)])));
  }
  const std::string first = SceneToJson(Run().scene);
  for (const int threads : {1, 3, 2}) {
    QuietRun run(threads);
    const ScratchFolder scratch;
    const ImportResult again = ImportScene(folder_.path(), scratch.path(), options_, run.control());
    EXPECT_EQ(SceneToJson(again.scene), first) << threads << " threads";
  }
}

// An object that moves with the camera, e.g. a bonnet, would make it look static.
TEST_F(Sfm, IgnoresMaskedFeatures) {
  const std::vector<Pose> truth = RoomPoses(7);
  Random random(5);
  Image bonnet(400, 150, 1);
  for (float& v : bonnet.data) v = static_cast<float>(random.NextUniform());
  bonnet = Resize(Resize(bonnet, 100, 38), 400, 150);
  Image mask(400, 300, 1, 1.0f);
  std::fill(mask.data.begin() + 400 * 150, mask.data.end(), 0.0f);
  fs::create_directories(folder_.path() / "images");
  fs::create_directories(folder_.path() / "masks");
  for (int i = 0; i < 7; ++i) {
    Image photo = RenderCorner(kRoomCamera, truth[i]);
    std::copy(bonnet.data.begin(), bonnet.data.end(), photo.data.begin() + 400 * 150);
    WriteFileAtomic(folder_.path() / "images" / PhotoName(i), EncodePng8(photo));
    WriteFileAtomic(folder_.path() / "masks" / PhotoName(i), EncodePng8(mask));
  }
  const ImportResult result = Run();
  ASSERT_EQ(result.photos_registered, 7);
  EXPECT_EQ(result.masked_views, 7);
  Eigen::Matrix<double, 3, 7> found, expected;
  for (int i = 0; i < 7; ++i) {
    EXPECT_EQ(result.scene.views[i].mask_file, "masks/" + PhotoName(i));
    found.col(i) = result.scene.views[i].cam_from_world.Center();
    expected.col(i) = truth[i].Center();
  }
  const Eigen::Matrix4d align = Eigen::umeyama(found, expected);
  for (int i = 0; i < 7; ++i) {
    const Eigen::Vector3d aligned = (align * found.col(i).homogeneous()).head<3>();
    EXPECT_LT((aligned - expected.col(i)).norm(), 0.08) << i;  // the path is 2 long
  }
}

// Enough photos that most pairs are left out, with a known focal length.
TEST_F(Sfm, MatchesPlannedPairsWithFocalLength) {
  constexpr int kCount = 14;
  const Camera camera = kRoomCamera.Scaled(320, 240);
  const std::vector<Pose> poses = RoomPoses(kCount);
  const auto film_mm =
      static_cast<uint32_t>(std::lround(camera.fx * 43.2666 / std::hypot(320, 240)));
  for (int i = 0; i < kCount; ++i) {
    const std::string jpeg = EncodeJpeg(RenderCorner(camera, poses[i]));
    WriteFileAtomic(folder_.path() / ("p" + std::to_string(i) + ".jpg"),
                    WithExif(jpeg, {{41989, 3, film_mm}}));
  }
  options_.sfm_neighbors = 3;
  const ImportResult result = Run();
  EXPECT_EQ(result.photos_registered, kCount);
  EXPECT_FALSE(result.sfm.exhaustive);
  EXPECT_LT(result.sfm.pairs_tried, kCount * (kCount - 1) / 2);
  EXPECT_NEAR(result.scene.views[0].captured_camera.fx, camera.fx, 0.03 * camera.fx);
  const std::string log = ReadFile(scratch_.path() / "sfm.log");
  EXPECT_THAT(log, HasSubstr("color3d: planned " + result.sfm.plan));
  EXPECT_THAT(log, HasSubstr("(Prior)"));
}

TEST_F(Sfm, RefusesUnrelatedPhotosInOneLine) {
  Random random(1);
  for (int i = 0; i < 4; ++i) {
    Image photo(200, 150, 1);
    for (float& v : photo.data) v = static_cast<float>(random.NextUniform());
    WriteFileAtomic(folder_.path() / PhotoName(i), EncodePng8(photo));
  }
  const std::string said = Refusal([&] { Run(); });
  EXPECT_THAT(said, HasSubstr("none of 4 photos could be placed"));
  EXPECT_THAT(said, HasSubstr("overlap by 60 %"));
  EXPECT_THAT(said, HasSubstr("sfm.log"));
  EXPECT_EQ(said.find('\n'), std::string::npos);
}

// Comparing all pairs of many photos would take minutes and find nothing.
TEST_F(Sfm, RefusesManyUnrelatedPhotosQuickly) {
  for (int i = 0; i < 24; ++i) {
    Random random(static_cast<uint64_t>(i + 1));
    Image coarse(32, 24, 1);
    for (float& v : coarse.data) v = static_cast<float>(random.NextUniform());
    WriteFileAtomic(folder_.path() / PhotoName(i), EncodePng8(Resize(coarse, 320, 240)));
  }
  options_.sfm_neighbors = 3;
  EXPECT_THAT(Refusal([&] { Run(); }), HasSubstr("none of 24 photos could be placed"));
  EXPECT_EQ(progress_.messages.find("blocks of photos"), std::string::npos);
  EXPECT_EQ(progress_.messages.find("widened"), std::string::npos);
}

// A film of a fixed camera, with noise and a passing object, is refused before COLMAP starts.
TEST_F(Sfm, RefusesStaticCameraAtOnce) {
  const Image background = RenderCorner(kRoomCamera, RoomPoses(3)[1]);
  Random random(4);
  for (int i = 0; i < 40; ++i) {
    Image photo = background;
    for (int y = 90; y < 210; ++y) {
      for (int x = 8 * i; x < 8 * i + 60; ++x) {
        photo.At(0, y, x) = CornerTexture(0.02 * (x - 8 * i), 0.02 * y, 7);
      }
    }
    for (float& v : photo.data) v += 0.02f * static_cast<float>(random.NextNormal());
    WriteFileAtomic(folder_.path() / PhotoName(i), EncodePng8(photo));
  }
  const auto start = std::chrono::steady_clock::now();
  const std::string said = Refusal([&] { Run(); });
  EXPECT_THAT(said, HasSubstr("taken from one place"));
  EXPECT_THAT(said, HasSubstr("pairs of photos"));
  EXPECT_THAT(said, HasSubstr("a step to the side"));
  EXPECT_EQ(said.find('\n'), std::string::npos);
  EXPECT_EQ(ReadFile(scratch_.path() / "sfm.log").find("Processed file"), std::string::npos);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
}

TEST_F(Sfm, RefusesFlatPhotosAndTwoPhotos) {
  for (int i = 0; i < 2; ++i) {
    WriteFileAtomic(folder_.path() / PhotoName(i), EncodePng8(Image(64, 48, 1, 0.5f)));
  }
  EXPECT_THAT(Refusal([&] { Run(); }), HasSubstr("2 photos could be placed"));
}

TEST_F(Sfm, CancellationStopsChild) {
  const std::vector<Pose> poses = RoomPoses(6);
  for (int i = 0; i < 6; ++i) {
    WriteFileAtomic(folder_.path() / PhotoName(i), EncodePng8(RenderCorner(kRoomCamera, poses[i])));
  }
  std::thread canceller([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    run_.cancel().Cancel();
  });
  EXPECT_THAT(Refusal([&] { Run(); }), HasSubstr("cancelled"));
  canceller.join();
}

std::vector<LocalFeatures> FeaturesOf(const fs::path& folder) {
  std::vector<LocalFeatures> features;
  for (const std::string& name : ListFiles(folder)) {
    features.push_back(DetectLocalFeatures(FeatureImage(ReadImage(folder / name), 384), 300));
  }
  return features;
}

TEST(Parallax, TellsRealCapturesFromStaticCamera) {
  const fs::path data = COLOR3D_SHARED_DATA;
  if (!fs::exists(data / "scenes/fern/images")) GTEST_SKIP() << "no " << data;
  ThreadPool pool(2);
  for (const char* folder : {"scenes/banana/images",
                             "scenes/fern/images",
                             "scenes/fox/images",
                             "scenes/head/images",
                             "scenes/sceaux/images",
                             "scenes/street/images",
                             "video/lady_running",
                             "video/man_walking",
                             "video/athlete4cam/cam01",
                             "video/athlete4cam/cam03"}) {
    if (!fs::exists(data / folder)) continue;
    const bool fixed = std::string(folder).find("athlete") != std::string::npos;
    const ParallaxEvidence evidence = MeasureParallax(FeaturesOf(data / folder), pool, {});
    EXPECT_EQ(evidence.IsFromOnePlace(), fixed) << folder << ": " << Describe(evidence);
    const double share = evidence.matched > 0 ? 1.0 * evidence.turned / evidence.matched : 0.0;
    EXPECT_TRUE(fixed ? share > 0.95 : share < 0.75) << folder << ": " << Describe(evidence);
  }
}

TEST_F(Sfm, AgreesWithModelOfRealPhotos) {
  const fs::path sceaux = fs::path(COLOR3D_SHARED_DATA) / "scenes/sceaux";
  if (!fs::exists(sceaux / "sparse/0")) GTEST_SKIP() << "no " << sceaux;
  for (const auto& entry : fs::directory_iterator(sceaux / "images")) {
    fs::copy(entry.path(), folder_.path() / entry.path().filename());
  }
  const Scene reference = ReadColmapModel(sceaux / "sparse/0", sceaux);
  const ImportResult result = Run();
  EXPECT_EQ(result.photos_registered, 11);
  double worst_deg = 0.0;
  const Eigen::Quaterniond first = result.scene.views[0].cam_from_world.rotation;
  const Eigen::Quaterniond reference_first =
      reference.views[reference.FindView(result.scene.views[0].name)].cam_from_world.rotation;
  for (const View& view : result.scene.views) {
    const Pose& pose = reference.views[reference.FindView(view.name)].cam_from_world;
    const Eigen::Quaterniond got = view.cam_from_world.rotation * first.conjugate();
    const Eigen::Quaterniond expected = pose.rotation * reference_first.conjugate();
    worst_deg = std::max(worst_deg, got.angularDistance(expected) * 180.0 / M_PI);
  }
  EXPECT_LT(worst_deg, 1.0);
}

}  // namespace
}  // namespace color3d
