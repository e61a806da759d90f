#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/splat/motion/geometry_in_time.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "tests/support/formats/movie_reader.h"
#include "tests/support/stages/evaluated_scene.h"

namespace color3d {
namespace {

using Path = RenderOptions::Path;
using ::testing::HasSubstr;

class MovieTest : public EvaluatedSceneTest {
 protected:
  // Runs the stage and returns the folder of results.
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

  // Makes a dynamic scene: the views at these times, of one camera, and a moving ball.
  void MakeMoving(const std::vector<double>& times) {
    for (size_t i = 0; i < times.size(); ++i) scene_.views[i].moment = Moment{times[i], 0};
    AddInput(artifact::kScene, SceneToJson(scene_));
    AddInput(artifact::kKeyView, R"({"view": "p1.png"})");
    AddInput(artifact::kModel, SerializeGaussians(BallBeforeWall(times.front(), times.back())));
  }

  std::vector<std::string> outputs_;
};

// Column of the bright ball, px.
double BallColumn(const Image& image) {
  double sum = 0.0, weighted = 0.0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double light = std::max(0.0, image.At(1, y, x) - 0.5);
      sum += light;
      weighted += light * (x + 0.5);
    }
  }
  return weighted / sum;
}

// Column in which a camera of RampScene at x = `camera_x` sees a ball, px.
double ColumnOf(double ball_x, double camera_x = 0.0) {
  return 24.0 + 50.0 * (ball_x - camera_x) / kBallDepth;
}

// Peak signal-to-noise ratio in sRGB, dB.
double PsnrDb(const Image& a, const Image& b) {
  double sum = 0.0;
  for (size_t i = 0; i < a.data.size(); ++i) sum += std::pow(a.data[i] - b.data[i], 2.0);
  return -10.0 * std::log10(sum / static_cast<double>(a.data.size()));
}

TEST_F(MovieTest, MovieEqualsPictures) {
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
    EXPECT_GT(PsnrDb(first, last), 25.0) << "the path is closed";
  }
}

TEST_F(MovieTest, OriginalPathStartsAtTheFirstPhoto) {
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

TEST_F(MovieTest, FrameWithoutPoseLeavesAGap) {
  scene_.views.push_back(scene_.views[0]);
  scene_.views.push_back(scene_.views[1]);
  const double times[] = {0.0, 0.5, 0.75, 1.0, 1.25};  // the second one has no pose
  for (int i = 0; i < 5; ++i) {
    scene_.views[i].name = "f" + std::to_string(i) + ".png";
    scene_.views[i].moment = Moment{times[i], 0};
  }
  AddInput(artifact::kScene, SceneToJson(scene_));
  const ReadMovie movie = DecodeMovie(Render({.path = Path::kPhotos}) / "scene.mp4");
  ASSERT_EQ(movie.times.size(), 5u);
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(movie.times[i], times[i], 1e-4) << i;
  EXPECT_NEAR(movie.seconds, 1.5, 0.01);
}

TEST_F(MovieTest, StillCameraShowsAllTimes) {
  MakeMoving({0.0, 1.0, 2.5});
  const auto out = Render({.path = Path::kStill, .pictures = true});
  const ReadMovie movie = DecodeMovie(out / "scene.mp4");
  ASSERT_EQ(movie.times.size(), 3u);
  EXPECT_NEAR(movie.times[1], 1.0, 1e-4);
  EXPECT_NEAR(movie.times[2], 2.5, 1e-4);
  const double ball_x[] = {-0.4, -0.08, 0.4};
  for (int i = 0; i < 3; ++i) {  // p1 stands at x = -0.1
    const Image frame = ReadImage(out / ("frames/0000" + std::to_string(i + 1) + ".png"));
    EXPECT_NEAR(BallColumn(frame), ColumnOf(ball_x[i], -0.1), 0.6) << i;
  }
}

TEST_F(MovieTest, BounceKeepsTheSpeedOfTheFilm) {
  MakeMoving({0.0, 0.5, 1.5});
  const ReadMovie movie =
      DecodeMovie(Render({.path = Path::kPhotos, .bounce = true}) / "scene.mp4");
  ASSERT_EQ(movie.times.size(), 4u);
  EXPECT_NEAR(movie.times[1], 0.5, 1e-4);
  EXPECT_NEAR(movie.times[2], 1.5, 1e-4);
}

TEST_F(MovieTest, OrbitShowsOneTime) {
  MakeMoving({0.0, 1.0, 2.5});
  const RenderOptions options{
      .path = Path::kOrbit, .frames = 4, .video = false, .pictures = true, .time_s = 1.0};
  const auto bytes = [&](const RenderOptions& asked) {
    const auto out = Render(asked);
    std::vector<std::string> files;
    for (const std::string& name : outputs_) files.push_back(ReadFile(out / name));
    return files;
  };
  const std::vector<std::string> frozen = bytes(options);
  ASSERT_EQ(frozen.size(), 4u);
  EXPECT_NE(frozen[0], frozen[1]) << "the camera turns";
  RenderOptions later = options;
  later.time_s = 2.5;
  EXPECT_NE(bytes(later)[1], frozen[1]);
  // The static scene of that time gives the same pictures.
  ThreadPool pool(1);
  AddInput(artifact::kModel, SerializeGaussians(ModelAt(BallBeforeWall(0.0, 2.5), 1.0, pool)));
  EXPECT_EQ(bytes(options), frozen);
}

TEST_F(MovieTest, RefusesATimeAfterTheEnd) {
  MakeMoving({0.0, 1.0, 89.0 / 30.0});
  RenderOptions options{.path = Path::kOrbit, .frames = 2, .time_s = 3.0};
  EXPECT_THAT(Complaint(options),
              HasSubstr("(time_s) is at 3 s, but the scene lasts from 0 to 2.96667 s"));
  options.time_s = 2.96667;  // as the message gives it
  EXPECT_EQ(Complaint(options), "none");
}

TEST_F(MovieTest, FileOfCamerasMayHaveTimes) {
  MakeMoving({0.0, 1.0, 2.0});
  const auto at = [](double time_s) {
    return "{\"time\":" + std::to_string(time_s) +
           ",\"transform_matrix\":[[1,0,0,0],[0,-1,0,0],[0,0,-1,0],[0,0,0,1]]}";
  };
  RenderOptions options{.path = Path::kCameras,
                        .pictures = true,
                        .cameras = CameraFile(at(2.0) + "," + at(0.0) + "," + at(1.0))};
  auto out = Render(options);
  const double ball_x[] = {0.4, -0.4, 0.0};
  for (int i = 0; i < 3; ++i) {
    const Image frame = ReadImage(out / ("frames/0000" + std::to_string(i + 1) + ".png"));
    EXPECT_NEAR(BallColumn(frame), ColumnOf(ball_x[i]), 0.6) << i;
  }
  options.frames = 3;  // on a smooth path from the first camera to the second
  options.cameras = CameraFile(at(0.0) + "," + at(2.0));
  out = Render(options);
  for (int i = 0; i < 3; ++i) {
    const Image frame = ReadImage(out / ("frames/0000" + std::to_string(i + 1) + ".png"));
    EXPECT_NEAR(BallColumn(frame), ColumnOf(-0.4 + 0.4 * i), 0.6) << i;
  }
  options.cameras = CameraFile(at(0.0) + "," + FrameAt(0.0));
  EXPECT_THAT(Complaint(options), HasSubstr("frame 1 has no time, unlike those before it"));
  options.cameras = CameraFile(at(0.0) + "," + at(2.5));
  EXPECT_THAT(Complaint(options),
              HasSubstr("frame 1 is at 2.5 s, but the scene lasts from 0 to 2"));
}

TEST_F(MovieTest, FileOfCamerasIsExactOrSmooth) {
  const std::string frames = FrameAt(0.0) + "," + FrameAt(-0.1) + "," + FrameAt(-0.2);
  RenderOptions options{.path = Path::kCameras, .pictures = true, .cameras = CameraFile(frames)};
  auto out = Render(options);
  EXPECT_EQ(DecodeMovie(out / "scene.mp4").frames.size(), 3u);
  const Image third = ReadImage(out / "frames/00003.png");
  // In OpenGL axes (x right, y up), these are the cameras of the photos.
  const auto views = Render({.views = {"p2.png"}});
  EXPECT_GT(PsnrDb(third, ReadImage(views / "renders/p2.png")), 60.0);
  options.bounce = true;
  EXPECT_EQ(DecodeMovie(Render(options) / "scene.mp4").frames.size(), 4u);
  options.frames = 11;
  EXPECT_EQ(DecodeMovie(Render(options) / "scene.mp4").frames.size(), 11u);
}

TEST_F(MovieTest, MakesSizesEvenAndRefusesTinyOnes) {
  for (View& view : scene_.views) view.camera = {101, 77, 100.0, 100.0, 50.5, 38.5};
  AddInput(artifact::kScene, SceneToJson(scene_));
  const ReadMovie movie = DecodeMovie(Render({.path = Path::kOrbit, .frames = 2}) / "scene.mp4");
  EXPECT_EQ(movie.width, 100);
  EXPECT_EQ(movie.height, 76);
  const auto tiny = CameraFile("");
  WriteFileAtomic(tiny, "{\"w\":1,\"h\":1,\"fl_x\":1,\"frames\":[" + FrameAt(0) + "]}");
  EXPECT_THAT(Complaint({.path = Path::kCameras, .cameras = tiny}), HasSubstr("0 x 0 px"));
}

TEST_F(MovieTest, ErrorsNameTheProblem) {
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .frames = 0}), HasSubstr("frames"));
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .frames = 18'001}), HasSubstr("18000"));
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .frames = 1'001, .pictures = true}),
              HasSubstr("the limit is 1000"));
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .frames_per_second = NAN}),
              HasSubstr("frames_per_second"));
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .video = false}), HasSubstr("nothing"));
  EXPECT_THAT(Complaint({.path = Path::kCameras}), HasSubstr("needs a file"));
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .cameras = CameraFile(FrameAt(0))}),
              HasSubstr("by cameras only"));
  EXPECT_THAT(Complaint({.path = Path::kCameras, .cameras = CameraFile("{")}),
              HasSubstr("not JSON"));
  EXPECT_THAT(Complaint({.views = {"no such"}, .path = Path::kPhotos}), HasSubstr("no such"));
  GaussianModel nothing;
  nothing.channels = 3;
  AddInput(artifact::kModel, SerializeGaussians(nothing));
  EXPECT_THAT(Complaint({.path = Path::kOrbit}), HasSubstr("no Gaussians"));
  EXPECT_THAT(Complaint({}), HasSubstr("no Gaussians"));
}

TEST_F(MovieTest, RefusesPathsThroughFilmsWithoutPoses) {
  for (int i = 0; i < 3; ++i) {
    scene_.views[i].cam_from_world = Pose{};
    scene_.views[i].moment = Moment{0.1 * i, 0};
  }
  ASSERT_FALSE(scene_.capture().is_reconstructed);
  AddInput(artifact::kScene, SceneToJson(scene_));
  for (const Path path : {Path::kOrbit, Path::kPhotos, Path::kStill}) {
    EXPECT_THAT(Complaint({.path = path}), HasSubstr("this film has no poses"));
  }
}

TEST_F(MovieTest, WarnsThatPhotosHaveNoFrames) {
  Render({.pictures = true});
  EXPECT_THAT(observer_.text, HasSubstr("pictures is ignored"));
}

TEST_F(MovieTest, CancelledMovieLeavesNothing) {
  cancel_.Cancel();
  EXPECT_THAT(Complaint({.path = Path::kOrbit, .frames = 2}), HasSubstr("cancelled"));
  EXPECT_FALSE(std::filesystem::exists(scratch_.path() / "scene.mp4.part"));
}

}  // namespace
}  // namespace color3d
