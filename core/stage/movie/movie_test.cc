#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/stage/formats/artifacts.h"
#include "core/stage/stages.h"
#include "tests/support/formats/movie_reader.h"
#include "tests/support/stages/evaluated_scene.h"

namespace color3d {
namespace {

using Path = RenderOptions::Path;
using ::testing::HasSubstr;

class MovieTest : public EvaluatedSceneTest {
 protected:
  // Runs the stage; the folder of results.
  std::filesystem::path Render(const RenderOptions& options) {
    std::filesystem::remove_all(scratch_.path() / "out");
    StageContext context = MakeContext();
    RunRender(options, context);
    outputs_ = context.outputs();
    return scratch_.path() / "out";
  }
  std::string Complaint(const RenderOptions& options) {
    try {
      Render(options);
    } catch (const Error& e) {
      EXPECT_FALSE(std::filesystem::exists(scratch_.path() / "out/scene.mp4"));
      return e.what();
    }
    return "none";
  }
  std::filesystem::path CameraFile(const std::string& frames) {
    const auto file = scratch_.path() / "cameras.json";
    WriteFileAtomic(file, "{\"w\":48,\"h\":32,\"fl_x\":50,\"frames\":[" + frames + "]}");
    return file;
  }
  static std::string FrameAt(double x) {
    return "{\"transform_matrix\":[[1,0,0," + std::to_string(x) +
           "],[0,-1,0,0],[0,0,-1,0],[0,0,0,1]]}";
  }

  std::vector<std::string> outputs_;
};

// Mean over the pixels of the root of the mean squared difference in sRGB, as a peak ratio.
double PsnrDb(const Image& a, const Image& b) {
  double sum = 0.0;
  for (size_t i = 0; i < a.data.size(); ++i) sum += std::pow(a.data[i] - b.data[i], 2.0);
  return -10.0 * std::log10(sum / static_cast<double>(a.data.size()));
}

TEST_F(MovieTest, TheMovieShowsWhatThePicturesShow) {
  AddInput(artifact::kKeyView, R"({"view": "p1.png"})");
  for (const Path path : {Path::kOrbit, Path::kPhotos}) {
    const auto out = Render({.path = path,
                             .frames = 30,
                             .frames_per_second = 15,
                             .pictures = true,
                             .bounce = path == Path::kPhotos});
    const ReadMovie movie = DecodeMovie(out / "scene.mp4");
    EXPECT_EQ(movie.width, 48);
    EXPECT_EQ(movie.height, 32);
    EXPECT_NEAR(movie.seconds, 2.0, 0.07);
    ASSERT_EQ(movie.frames.size(), 30u);
    ASSERT_EQ(outputs_.size(), 31u);
    double moved = 0.0;
    Image first, last;
    for (int i = 0; i < 30; ++i) {
      const Image picture = ReadImage(out / outputs_[i]);
      EXPECT_GT(PsnrDb(movie.frames[i], picture), 30.0) << outputs_[i];
      if (i == 0) first = picture;
      if (i == 29) last = picture;
      moved = std::max(moved, -PsnrDb(first, picture));
    }
    EXPECT_EQ(outputs_.front(), "frames/00001.png");
    EXPECT_EQ(outputs_.back(), "scene.mp4");
    EXPECT_GT(moved, -40.0) << "nothing moves";
    EXPECT_GT(PsnrDb(first, last), 25.0) << "the end meets the beginning";
  }
}

TEST_F(MovieTest, TheFirstFrameOfTheOriginalPathIsTheFirstPhotosView) {
  const auto out = Render({.views = {"p2.png", "p0.png"},
                           .path = Path::kPhotos,
                           .frames = 5,
                           .video = false,
                           .pictures = true});
  const Image first = ReadImage(out / "frames/00001.png");
  const Image last = ReadImage(out / "frames/00005.png");
  EXPECT_EQ(outputs_.size(), 5u);
  const auto views = Render({.views = {"p2.png", "p0.png"}});
  EXPECT_GT(PsnrDb(first, ReadImage(views / "renders/p2.png")), 60.0);
  EXPECT_GT(PsnrDb(last, ReadImage(views / "renders/p0.png")), 60.0);
  EXPECT_LT(PsnrDb(first, last), 40.0);
}

TEST_F(MovieTest, AFrameWithoutAPlaceDoesNotSlowTheMovieDown) {
  scene_.views.push_back(scene_.views[0]);
  scene_.views.push_back(scene_.views[1]);
  const double times[] = {0.0, 0.5, 0.75, 1.0, 1.25};  // the second found no place
  for (int i = 0; i < 5; ++i) {
    scene_.views[i].name = "f" + std::to_string(i) + ".png";
    scene_.views[i].moment = Moment{times[i], 0};
  }
  AddInput(artifact::kScene, SceneToJson(scene_));
  const ReadMovie movie = DecodeMovie(Render({.path = Path::kPhotos}) / "scene.mp4");
  EXPECT_EQ(movie.frames.size(), 5u);
  EXPECT_NEAR(movie.seconds, 1.25, 0.01);
}

TEST_F(MovieTest, CamerasOfAFileAreTakenOneByOneOrSmoothly) {
  const std::string frames = FrameAt(0.0) + "," + FrameAt(-0.1) + "," + FrameAt(-0.2);
  RenderOptions options{.path = Path::kCameras, .pictures = true, .cameras = CameraFile(frames)};
  auto out = Render(options);
  EXPECT_EQ(DecodeMovie(out / "scene.mp4").frames.size(), 3u);
  const Image third = ReadImage(out / "frames/00003.png");
  // The file's OpenGL axes, x right, y up: these are the photos' cameras.
  const auto views = Render({.views = {"p2.png"}});
  EXPECT_GT(PsnrDb(third, ReadImage(views / "renders/p2.png")), 60.0);
  options.bounce = true;
  EXPECT_EQ(DecodeMovie(Render(options) / "scene.mp4").frames.size(), 4u);
  options.frames = 11;
  EXPECT_EQ(DecodeMovie(Render(options) / "scene.mp4").frames.size(), 11u);
}

TEST_F(MovieTest, OddSizesBecomeEvenAndTinyOnesAreRefused) {
  for (View& view : scene_.views) view.camera = {101, 77, 100.0, 100.0, 50.5, 38.5};
  AddInput(artifact::kScene, SceneToJson(scene_));
  const ReadMovie movie = DecodeMovie(Render({.path = Path::kOrbit, .frames = 2}) / "scene.mp4");
  EXPECT_EQ(movie.width, 100);
  EXPECT_EQ(movie.height, 76);
  const auto tiny = CameraFile("");
  WriteFileAtomic(tiny, "{\"w\":1,\"h\":1,\"fl_x\":1,\"frames\":[" + FrameAt(0) + "]}");
  EXPECT_THAT(Complaint({.path = Path::kCameras, .cameras = tiny}), HasSubstr("0 x 0 px"));
}

TEST_F(MovieTest, WhatCannotBeRenderedIsNamed) {
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .frames = 0}), HasSubstr("frames"));
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .frames = 18'001}), HasSubstr("18000"));
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .frames = 1'001, .pictures = true}),
              HasSubstr("at most 1000"));
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .frames_per_second = NAN}),
              HasSubstr("frames_per_second"));
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .video = false}), HasSubstr("nothing"));
  EXPECT_THAT(Complaint({.path = Path::kCameras}), HasSubstr("needs a file"));
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .cameras = CameraFile(FrameAt(0))}),
              HasSubstr("no other path"));
  EXPECT_THAT(Complaint({.path = Path::kCameras, .cameras = CameraFile("{")}),
              HasSubstr("not JSON"));
  EXPECT_THAT(Complaint({.views = {"no such"}, .path = Path::kPhotos}), HasSubstr("no such"));
  GaussianModel nothing;
  nothing.channels = 3;
  AddInput(artifact::kModel, SerializeGaussians(nothing));
  EXPECT_THAT(Complaint({.path = Path::kOrbit}), HasSubstr("no Gaussians"));
  EXPECT_THAT(Complaint({}), HasSubstr("no Gaussians"));
}

TEST_F(MovieTest, AFilmWithoutPosesIsNoPlaceToMoveThrough) {
  for (int i = 0; i < 3; ++i) {
    scene_.views[i].cam_from_world = Pose{};
    scene_.views[i].moment = Moment{0.1 * i, 0};
  }
  ASSERT_TRUE(scene_.IsFilm());
  AddInput(artifact::kScene, SceneToJson(scene_));
  for (const Path path : {Path::kOrbit, Path::kPhotos, Path::kStill}) {
    EXPECT_THAT(Complaint({.path = path}), HasSubstr("this film has no poses"));
  }
}

TEST_F(MovieTest, ACancelledMovieLeavesNothing) {
  cancel_.Cancel();
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .frames = 2}), HasSubstr("cancelled"));
  EXPECT_FALSE(std::filesystem::exists(scratch_.path() / "scene.mp4.part"));
}

}  // namespace
}  // namespace color3d
