#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "core/video/mp4_writer.h"
#include "tests/support/formats/npy_writer.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

constexpr int kWidth = 96, kHeight = 64;

class ImportCameraFilmsTest : public StageTest {
 protected:
  // Grey level that identifies camera and frame.
  static double Gray(int camera, int frame) { return 0.2 + 0.2 * camera + 0.02 * frame; }
  void WriteFilm(int camera, int frames, double frames_per_second = 10) {
    ThreadPool pool(1);
    Mp4Writer writer(scratch_.path() / ("cam0" + std::to_string(camera) + ".mp4"),
                     {.width = kWidth, .height = kHeight, .frames_per_second = frames_per_second});
    for (int i = 0; i < frames; ++i) {
      writer.Add(Image(kWidth, kHeight, 3, static_cast<float>(Gray(camera, i))), pool);
    }
    writer.Finish();
  }
  // Frames at multiples of 0.1 s, without one dropped frame.
  void WriteFilmWithout(int camera, int frames, int dropped) {
    ThreadPool pool(1);
    Mp4Writer writer(
        scratch_.path() / ("cam0" + std::to_string(camera) + ".mp4"),
        {.width = kWidth, .height = kHeight, .frames_per_second = 10, .ticks_per_second = 1000});
    for (int i = 0; i < frames; ++i) {
      if (i == dropped) continue;
      writer.AddAt(
          0.1 * i, 0.1, Image(kWidth, kHeight, 3, static_cast<float>(Gray(camera, i))), pool);
    }
    writer.Finish();
  }
  void WritePoses(int cameras) {
    std::vector<double> rows;
    for (int i = 0; i < cameras; ++i) {
      const double matrix[3][5] = {{0, 1, 0, 0.5 * i, 128}, {-1, 0, 0, 0, 192}, {0, 0, 1, 4, 240}};
      for (const auto& row : matrix) rows.insert(rows.end(), row, row + 5);
      rows.insert(rows.end(), {1.0, 10.0});
    }
    WriteFileAtomic(scratch_.path() / "poses_bounds.npy",
                    NpyOf({static_cast<size_t>(cameras), 17}, rows));
  }
  // Poses of the first two films; `of_second`: more fields of the second one.
  void WriteTransforms(const std::string& of_second) {
    const auto frame = [](const std::string& file, const std::string& more, double x) {
      return "{\"file_path\":\"" + file + "\"," + more + "\"transform_matrix\":[[1,0,0," +
             std::to_string(x) + "],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}";
    };
    WriteFileAtomic(scratch_.path() / "transforms.json",
                    "{\"fl_x\":90,\"frames\":[" + frame("cam00.mp4", "", 0.0) + "," +
                        frame("cam01.mp4", of_second, 0.5) + "]}");
  }
  Scene Import(const FilmOptions& film = {}, const ImportOptions& options = {}) {
    fs::remove_all(scratch_.path() / "out");
    observer_.text.clear();
    StageContext context = MakeContext();
    RunImportScene(options, context, {}, film);
    return SceneFromJson(ReadFile(scratch_.path() / "out/scene.json"));
  }
  std::string Complaint(const FilmOptions& film = {}, const ImportOptions& options = {}) {
    try {
      Import(film, options);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }
};

TEST_F(ImportCameraFilmsTest, MakesViewsWithPosesAndTimes) {
  WriteFilm(0, 12);
  WriteFilm(1, 9);  // cameras of different lengths
  WritePoses(2);
  ImportOptions options;
  options.hold_out_every_eighth = true;
  const Scene scene = Import({}, options);
  ASSERT_EQ(scene.views.size(), 21u);
  EXPECT_TRUE(scene.capture().is_dynamic);
  const View& view = scene.views[12 + 4];
  EXPECT_EQ(view.name, "cam01/f000004.png");
  EXPECT_NEAR(view.moment->time_s, 0.4, 1e-6);
  EXPECT_EQ(view.moment->time_s, scene.views[4].moment->time_s);
  EXPECT_EQ(view.moment->shot, 1);
  EXPECT_TRUE(view.held_out);
  EXPECT_EQ(scene.HeldOutViews().size(), 2u);
  EXPECT_NEAR(view.camera.fx, 120.0, 1e-9);
  const Image frame = ReadImage(scratch_.path() / "out" / view.image_file);
  EXPECT_EQ(frame.channels, 1);
  EXPECT_NEAR(frame.At(0, 30, 40), Gray(1, 4), 0.02);
  EXPECT_EQ(scene.points.size(), 20000u);
  const ImportFacts facts = ImportFactsFromJson(ReadFile(scratch_.path() / "out/import.json"));
  EXPECT_EQ(facts.layout, CaptureLayout::kPosedFilms);
  EXPECT_EQ(facts.photos_found, 21);
}

TEST_F(ImportCameraFilmsTest, AppliesStridePartAndHeldOutCamera) {
  for (int camera = 0; camera < 3; ++camera) WriteFilm(camera, 12);
  WritePoses(3);
  ImportOptions options;
  options.hold_out_camera = "cam02";
  const Scene scene = Import({.stride = 2, .begin_s = 0.25, .end_s = 0.95}, options);
  ASSERT_EQ(scene.views.size(), 12u);  // frames 3, 5, 7, 9
  EXPECT_EQ(scene.views[1].name, "cam00/f000005.png");
  EXPECT_NEAR(scene.views[1].moment->time_s, 0.2, 1e-6);  // relative to the first selected one
  for (const View& view : scene.views) {
    EXPECT_EQ(view.held_out, view.name.starts_with("cam02/")) << view.name;
  }
  EXPECT_THAT(Complaint({.begin_s = 9.0}),
              HasSubstr("cam00.mp4: the film has no frame in the requested part"));
  options.hold_out_camera = "cam09";
  EXPECT_THAT(Complaint({}, options), HasSubstr("the scene has cam00, cam01, cam02"));
}

TEST_F(ImportCameraFilmsTest, RefusesTooManyFrames) {
  for (int camera = 0; camera < 2; ++camera) WriteFilm(camera, 1510);
  WritePoses(2);
  EXPECT_THAT(Complaint({}), HasSubstr("3020 frames"));
  EXPECT_THAT(Complaint({}), HasSubstr("set film_stride to 2"));
}

TEST_F(ImportCameraFilmsTest, MakesStaticSceneOfOneTime) {
  for (int camera = 0; camera < 3; ++camera) WriteFilm(camera, 4);
  WritePoses(3);
  const Scene scene = Import({.stride = 100});
  ASSERT_EQ(scene.views.size(), 3u);
  EXPECT_FALSE(scene.views[0].moment);
  EXPECT_THAT(observer_.text, HasSubstr("the scene is static"));
}

TEST_F(ImportCameraFilmsTest, WarnsOfDifferentRates) {
  WriteFilm(0, 8, 10);
  WriteFilm(1, 8, 17);
  WritePoses(2);
  Import();
  EXPECT_THAT(observer_.text, HasSubstr("not taken at the same times"));
}

TEST_F(ImportCameraFilmsTest, AppliesTimeOffsets) {
  WriteFilm(0, 8);
  WriteFilm(1, 8);
  WriteTransforms("\"time_offset\":-0.25,");
  Scene scene = Import();  // cam01 starts 2.5 frames before cam00
  EXPECT_NEAR(scene.views[0].time_s(), 0.25, 1e-6);
  EXPECT_EQ(scene.views[8].name, "cam01/f000000.png");
  EXPECT_NEAR(scene.views[8].time_s(), 0.0, 1e-6);
  EXPECT_NEAR(scene.views[15].time_s(), 0.7, 1e-6);
  EXPECT_THAT(observer_.text, HasSubstr("not taken at the same times"));
  const auto facts = ImportFactsFromJson(ReadFile(scratch_.path() / "out/import.json"));
  ASSERT_EQ(facts.cameras.size(), 2u);
  EXPECT_EQ(facts.cameras[1].name, "cam01");
  EXPECT_EQ(facts.cameras[1].film, "cam01.mp4");
  WriteTransforms("\"time_offset\":0.3,");
  scene = Import();
  EXPECT_EQ(scene.views[8].time_s(), scene.views[3].time_s());
  WriteTransforms("\"time_offset\":\"late\",");
  EXPECT_THAT(Complaint(), HasSubstr("frame 1: time_offset must be a finite number"));
}

// Selected frames of each camera by their time.
using FramesAt = std::map<std::string, std::map<double, std::string>>;
FramesAt FramesOf(const Scene& scene) {
  FramesAt frames;
  for (const View& view : scene.views) {
    frames[view.name.substr(0, 5)][std::round(1000.0 * view.time_s()) / 1000.0] =
        view.name.substr(6, 7);
  }
  return frames;
}

TEST_F(ImportCameraFilmsTest, StrideSelectsSameTimesDespiteOffset) {
  WriteFilm(0, 8);
  WriteFilm(1, 8);
  WriteTransforms("\"time_offset\":0.1,");  // one frame
  EXPECT_EQ(
      FramesOf(Import({.stride = 2})),
      (FramesAt{
          {"cam00", {{0.0, "f000000"}, {0.2, "f000002"}, {0.4, "f000004"}, {0.6, "f000006"}}},
          {"cam01", {{0.2, "f000001"}, {0.4, "f000003"}, {0.6, "f000005"}, {0.8, "f000007"}}}}));
}

TEST_F(ImportCameraFilmsTest, StrideSelectsSameTimesDespiteDroppedFrame) {
  WriteFilm(0, 8);
  WriteFilmWithout(1, 8, 3);
  WriteTransforms("");
  EXPECT_EQ(
      FramesOf(Import({.stride = 2})),
      (FramesAt{
          {"cam00", {{0.0, "f000000"}, {0.2, "f000002"}, {0.4, "f000004"}, {0.6, "f000006"}}},
          {"cam01", {{0.0, "f000000"}, {0.2, "f000002"}, {0.4, "f000003"}, {0.6, "f000005"}}}}));
}

TEST_F(ImportCameraFilmsTest, PartIsTheSameDespiteOffset) {
  WriteFilm(0, 9);
  WriteFilm(1, 9);
  WriteTransforms("\"time_offset\":0.3,");
  EXPECT_EQ(FramesOf(Import({.begin_s = 0.5, .end_s = 0.7})),
            (FramesAt{{"cam00", {{0.0, "f000005"}, {0.1, "f000006"}}},
                      {"cam01", {{0.0, "f000002"}, {0.1, "f000003"}}}}));
  EXPECT_THAT(Complaint({.end_s = 0.25}),
              HasSubstr("cam01.mp4: the film has no frame in the requested part "
                        "(film_begin_s, film_end_s, film_stride); it runs from 0.30 to 1.10 s"));
}

TEST_F(ImportCameraFilmsTest, StrideCountsFramesWithoutCommonTimes) {
  WriteFilm(0, 8);
  WriteFilm(1, 8);
  WriteTransforms("\"time_offset\":0.05,");  // between two frames of the other camera
  const FramesAt frames = FramesOf(Import({.stride = 2}));
  EXPECT_EQ(frames.at("cam00").size(), 4u);
  EXPECT_EQ(frames.at("cam01").size(), 4u);
}

TEST_F(ImportCameraFilmsTest, WarnsOfDifferentTimesAndClocks) {
  WriteFilm(0, 8);
  WriteFilm(1, 8);
  WriteTransforms("\"time_offset\":0.72,");
  Import();  // only one frame of each was taken at nearly the same time
  EXPECT_THAT(observer_.text, HasSubstr("clocks differ by up to 0.02 s"));
  EXPECT_THAT(observer_.text, HasSubstr("not taken at the same times (15 times, 8 frames"));
}

TEST_F(ImportCameraFilmsTest, WarnsOfUnusedOptions) {
  for (int camera = 0; camera < 2; ++camera) WriteFilm(camera, 4);
  WritePoses(2);
  Import({.stride = 2});
  EXPECT_THAT(observer_.text, Not(HasSubstr("ignored")));
  Import({.frames_per_second = 16, .deflicker = true, .poses = FilmPoses::kAuto});
  EXPECT_THAT(observer_.text,
              HasSubstr("film_frames_per_second, film_deflicker, film_poses are ignored"));
}

TEST_F(ImportCameraFilmsTest, NamesUnreadableFilm) {
  WriteFilm(0, 4);
  WriteFileAtomic(scratch_.path() / "cam01.mp4", "no film");
  WritePoses(2);
  EXPECT_THAT(Complaint(), HasSubstr("cam01.mp4"));
}

}  // namespace
}  // namespace color3d
