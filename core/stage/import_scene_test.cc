#include <gtest/gtest.h>

#include "core/splat/export/export.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "tests/support/formats/viewer_files.h"
#include "tests/support/scenes/splat_files.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

TEST_F(StageTest, ImportsSplatAsViewsAndGeometry) {
  ViewerGaussians splat = BallOnGround(800, 0.0f, 1);
  splat.position[4] = std::nanf("");
  WriteFileAtomic(scratch_.path() / "scene.ply", SplatPly(splat));
  ImportOptions options;
  options.hold_out_every_eighth = true;
  StageContext import = MakeContext();
  RunImportScene(options, import, {.views = 8, .side_px = 96});
  EXPECT_NE(observer_.text.find("1 of the 800 Gaussians"), std::string::npos);
  const auto out = scratch_.path() / "out";
  const Scene scene = SceneFromJson(ReadFile(out / "scene.json"));
  ASSERT_EQ(scene.views.size(), 8u);
  EXPECT_EQ(scene.HeldOutViews(), (std::vector<int>{0}));
  EXPECT_EQ(ImportFactsFromJson(ReadFile(out / "import.json")).layout, CaptureLayout::kSplat);
  for (const View& view : scene.views) {
    const Image photo = ReadImage(out / view.image_file);
    EXPECT_EQ(photo.channels, 1);
    EXPECT_EQ(photo.width, 96);
    EXPECT_EQ(photo.height, 72);
  }
  inputs_[artifact::kScene] = out / "scene.json";
  inputs_[artifact::kGivenGeometry] = out / artifact::kGivenGeometry;
  StageContext reconstruct = MakeContext();
  RunReconstructGeometry({}, 96, reconstruct);
  EXPECT_EQ(ReadFile(out / artifact::kGeometry), ReadFile(out / artifact::kGivenGeometry));
  EXPECT_EQ(ParseGaussians(ReadFile(out / artifact::kGeometry)).size(), 799u);
}

TEST_F(StageTest, IgnoresSplatBesidePhotos) {
  RampScene(scratch_.path(), 32, 32);
  WriteFileAtomic(scratch_.path() / "points.ply", "ply");
  StageContext context = MakeContext();
  RunImportScene({}, context);
  const Scene scene = SceneFromJson(ReadFile(scratch_.path() / "out" / artifact::kScene));
  EXPECT_EQ(scene.kind(), CaptureKind::kPictures) << "three ramps cannot be placed";
  EXPECT_EQ(scene.views.size(), 3u);
  EXPECT_EQ(observer_.text.find("points.ply"), std::string::npos) << observer_.text;
  EXPECT_NE(observer_.text.find("coloured as pictures, without a 3D scene: none of 3 photos"),
            std::string::npos)
      << observer_.text;
}

TEST_F(StageTest, WarnsOfFilmOptionsForSplat) {
  WriteFileAtomic(scratch_.path() / "scene.ply", SplatPly(BallOnGround(800, 0.0f, 1)));
  StageContext context = MakeContext();
  RunImportScene({}, context, {.views = 8, .side_px = 96}, {.stride = 2, .deflicker = true});
  EXPECT_NE(observer_.text.find("film_stride, film_deflicker are ignored: the scene is no film"),
            std::string::npos)
      << observer_.text;
}

TEST_F(StageTest, WarnsOfFilmOptionsForTimedPictures) {
  std::string frames;
  for (const View& view : RampScene(scratch_.path(), 48, 32).views) {
    const double x = -view.cam_from_world.translation.x();
    frames += (frames.empty() ? "" : ",") + std::string("{\"file_path\":\"") + view.image_file +
              "\",\"time\":" + std::to_string(-10.0 * x) + ",\"transform_matrix\":[[1,0,0," +
              std::to_string(x) + "],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}";
  }
  WriteFileAtomic(scratch_.path() / "transforms.json", "{\"fl_x\":50,\"frames\":[" + frames + "]}");
  StageContext context = MakeContext();
  RunImportScene({}, context, {}, {.stride = 2, .frames_per_second = 16});
  EXPECT_NE(observer_.text.find("film_stride, film_frames_per_second are ignored: pictures with "
                                "times and poses are all taken"),
            std::string::npos)
      << observer_.text;
}

}  // namespace
}  // namespace color3d
