#include "core/stage/film_import/import_film.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/files.h"
#include "core/catalogue/captures.h"
#include "core/scene/scene.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "core/video/mp4_writer.h"
#include "tests/support/formats/interlaced_film.h"
#include "tests/support/formats/tone_film.h"
#include "tests/support/scenes/test_scenes.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int kWidth = 96, kHeight = 64;

// Moving waves, different for each place.
Image FrameOf(int place, int frame) {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      double v = 0.5;
      for (int k = 1; k <= 4; ++k) {
        const double a = 1.7 * place + 2.3 * k;
        v += 0.1 * std::sin(0.09 * k * ((x + frame) * std::cos(a) + y * std::sin(a)) + 3.1 * a);
      }
      for (int c = 0; c < 3; ++c) image.At(c, y, x) = static_cast<float>(v);
    }
  }
  return image;
}

class ImportFilmTest : public StageTest {
 protected:
  void WriteVideo(int frames, int frames_of_first_place) {
    ThreadPool pool(1);
    Mp4Writer writer(scratch_.path() / "film.mp4",
                     {.width = kWidth, .height = kHeight, .frames_per_second = 10});
    for (int i = 0; i < frames; ++i) {
      writer.Add(FrameOf(i < frames_of_first_place ? 1 : 2, i), pool);
    }
    writer.Finish();
  }
  void WriteFrame(const std::string& name, const Image& image) {
    fs::create_directories(scratch_.path() / "frames");
    WriteFileAtomic(scratch_.path() / "frames" / name, EncodePng8(image));
  }
  Scene Import(const FilmOptions& film = {}, const ImportOptions& options = {}) {
    fs::remove_all(scratch_.path() / "out");
    StageContext context = MakeContext();
    RunImportScene(options, context, {}, film);
    return SceneFromJson(ReadFile(scratch_.path() / "out/scene.json"));
  }
  std::string Complaint(const FilmOptions& film = {}) {
    try {
      Import(film);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }
};

TEST_F(ImportFilmTest, MakesViewsWithTimesOfVideo) {
  WriteVideo(24, 24);
  EXPECT_EQ(FindFilm(ListFiles(scratch_.path())), "film.mp4");
  ImportOptions options;
  options.hold_out_every_eighth = true;
  const Scene scene = Import({}, options);
  ASSERT_EQ(scene.views.size(), 24u);
  EXPECT_FALSE(scene.capture().is_reconstructed);
  EXPECT_EQ(scene.HeldOutViews(), (std::vector<int>{0, 8, 16}));
  EXPECT_EQ(scene.views[12].name, "f000012.png");
  EXPECT_NEAR(scene.views[12].moment->time_s, 1.2, 1e-6);
  EXPECT_EQ(scene.views[12].moment->shot, 0);
  EXPECT_EQ(ImportFactsFromJson(ReadFile(scratch_.path() / "out/import.json")).layout,
            CaptureLayout::kFilm);
  const Image frame = ReadImage(scratch_.path() / "out" / scene.views[12].image_file);
  EXPECT_EQ(frame.channels, 1);
  const Image truth = FrameOf(1, 12);
  double error = 0.0;
  for (size_t i = 0; i < frame.PlaneSize(); ++i) error += std::abs(frame.data[i] - truth.data[i]);
  EXPECT_LT(error / static_cast<double>(frame.PlaneSize()), 0.02);
  EXPECT_EQ(observer_.text, "");
}

TEST_F(ImportFilmTest, ReadsOneFieldOfInterlacedFilm) {
  WriteInterlacedFilm(scratch_.path() / "tape.mov", kWidth, kHeight, 6, [](int, int field, int x) {
    return 0.3 + 0.1 * field + 0.3 * std::sin(0.2 * x);
  });
  const Scene scene = Import();
  ASSERT_EQ(scene.views.size(), 6u);
  EXPECT_THAT(observer_.text, HasSubstr("the film is interlaced: one field of each frame"));
  const Image frame = ReadImage(scratch_.path() / "out" / scene.views[3].image_file);
  ASSERT_EQ(frame.height, kHeight);
  EXPECT_NEAR(frame.At(0, 20, 30), frame.At(0, 21, 30), 0.02) << "no line of the other field";
}

TEST_F(ImportFilmTest, AppliesPartsAndStridesAndFindsCuts) {
  WriteVideo(40, 20);
  EXPECT_EQ(Import().views[25].moment->shot, 1);
  EXPECT_THAT(observer_.text, HasSubstr("cuts before f000020.png: 2 shots"));
  const Scene part = Import({.stride = 3, .begin_s = 0.5, .end_s = 1.55});
  ASSERT_EQ(part.views.size(), 4u);  // frames 5, 8, 11, 14
  EXPECT_EQ(part.views[1].name, "f000008.png");
  EXPECT_THAT(Complaint({.begin_s = 9.0}), HasSubstr("it lasts 3.90 s"));
  EXPECT_THAT(Complaint({.begin_s = 2.0, .end_s = 1.0}),
              HasSubstr("film_end_s is 1 s, before film_begin_s (2 s)"));
  EXPECT_THAT(Complaint({.stride = 0}), HasSubstr("stride"));
  EXPECT_THAT(Complaint({.stride = 900}), HasSubstr("a film needs at least two frames"));
}

TEST_F(ImportFilmTest, ImportsPicturesInFrames) {
  for (int i = 0; i < 9; ++i) WriteFrame("n" + std::to_string(i) + ".png", FrameOf(1, i));
  WriteFrame("n4.png", Image(kWidth, kHeight, 3, 0.01f));
  EXPECT_EQ(FindFilm(ListFiles(scratch_.path())), "frames/");
  const Scene scene = Import();
  ASSERT_EQ(scene.views.size(), 9u);
  EXPECT_EQ(scene.views[2].image_file, "frames/n2.png");
  EXPECT_NEAR(scene.views[2].moment->time_s, 0.08, 1e-9);
  EXPECT_EQ(scene.views[5].moment->shot, 0);
  EXPECT_EQ(scene.views[4].moment->shot, 1);
  EXPECT_THAT(observer_.text, HasSubstr("1 frame with no detail: n4.png"));
  WriteFrame("n7.png", Image(kWidth, kHeight + 8, 3, 0.5f));
  EXPECT_THAT(Complaint(), HasSubstr("n7.png"));
}

TEST_F(ImportFilmTest, SortsPicturesByNumber) {
  for (int i = 1; i <= 12; ++i) WriteFrame("n" + std::to_string(i) + ".png", FrameOf(1, i));
  const Scene scene = Import();
  ASSERT_EQ(scene.views.size(), 12u);
  for (int i = 0; i < 12; ++i) {
    EXPECT_EQ(scene.views[i].name, "n" + std::to_string(i + 1) + ".png");
    EXPECT_NEAR(scene.views[i].moment->time_s, i / 25.0, 1e-12);
  }
}

TEST_F(ImportFilmTest, MissingFramesLeaveGaps) {
  for (const int i : {0, 1, 2, 3, 7, 8}) {
    WriteFrame(fmt::format("shot_{:04}.png", i), FrameOf(1, i));
  }
  const Scene scene = Import({.frames_per_second = 10});
  ASSERT_EQ(scene.views.size(), 6u);
  EXPECT_NEAR(scene.views[3].moment->time_s, 0.3, 1e-9);
  EXPECT_NEAR(scene.views[4].moment->time_s, 0.7, 1e-9);
  EXPECT_THAT(observer_.text,
              HasSubstr("3 frames are missing between shot_0003.png and shot_0007.png"));
}

TEST_F(ImportFilmTest, WarnsOfHdr) {
  ASSERT_TRUE(WriteToneFilm(scratch_.path() / "film.mkv",
                            {{.pixel_format = "yuv420p10le",
                              .range = "tv",
                              .transfer = "smpte2084",
                              .primaries = "bt2020"}}));
  EXPECT_EQ(Import().views.size(), 3u);
  EXPECT_THAT(observer_.text, HasSubstr("the film is HDR (PQ): its tones are mapped"));
}

TEST_F(ImportFilmTest, AppliesFrameRateToPictures) {
  for (int i = 0; i < 5; ++i) WriteFrame("n" + std::to_string(i) + ".png", FrameOf(1, i));
  EXPECT_NEAR(Import({.frames_per_second = 16}).views[4].moment->time_s, 0.25, 1e-12);
  EXPECT_NEAR(Import({.frames_per_second = 18}).views[3].moment->time_s, 3 / 18.0, 1e-12);
  EXPECT_THAT(Complaint({.frames_per_second = 0.0}), HasSubstr("frames_per_second"));
  fs::remove_all(scratch_.path() / "frames");
  WriteVideo(4, 4);
  EXPECT_THAT(Complaint({.frames_per_second = 16}), HasSubstr("film.mp4 has times of its own"));
}

TEST_F(ImportFilmTest, RefusesHeldOutCamera) {
  WriteVideo(4, 4);
  for (const FilmPoses poses : {FilmPoses::kOff, FilmPoses::kAuto}) {
    ImportOptions options;
    options.hold_out_camera = "cam01";
    EXPECT_THAT(Refusal([&] { Import({.poses = poses}, options); }),
                HasSubstr("hold_out_camera is 'cam01', but a film is of one camera"));
  }
}

TEST_F(ImportFilmTest, RefusesFramesWithOneStem) {
  WriteFrame("a.png", FrameOf(1, 0));
  WriteFrame("b.png", FrameOf(1, 1));
  WriteFileAtomic(scratch_.path() / "frames/a.jpg", EncodeJpeg(FrameOf(1, 2), 90));
  EXPECT_THAT(Complaint(), HasSubstr("a.jpg"));
}

TEST_F(ImportFilmTest, RefusesOneFrame) {
  WriteVideo(1, 1);
  EXPECT_THAT(Complaint(), HasSubstr("a film needs at least two frames"));
}

TEST_F(ImportFilmTest, RefusesFramesTooSmallForAMovie) {
  for (int i = 0; i < 2; ++i) {
    WriteFrame("n" + std::to_string(i) + ".png", Image(96, 15, 3, 0.3f + 0.1f * i));
  }
  EXPECT_THAT(
      Complaint(),
      HasSubstr("n0.png has 96 x 15 px, which makes a movie of 96 x 14 px; the shorter side "
                "of a movie must be at least 16 px: give larger frames"));
  for (int i = 0; i < 2; ++i) {
    WriteFrame("n" + std::to_string(i) + ".png", Image(96, 17, 3, 0.3f + 0.1f * i));
  }
  EXPECT_EQ(Complaint(), "");
}

TEST_F(ImportFilmTest, RefusesFourHoursWithRemedy) {
  ThreadPool pool(1);
  Mp4Writer writer(scratch_.path() / "film.mp4",
                   {.width = 32, .height = 16, .frames_per_second = 1, .ticks_per_second = 1000});
  constexpr int kFrames = 4 * 3600 / 4;  // one every 4 s
  const Image gray(32, 16, 3, 0.5f);
  for (int i = 0; i < kFrames; ++i) writer.AddAt(4.0 * i, 4.0, gray, pool);
  writer.Finish();
  const std::string complaint = Complaint();
  EXPECT_THAT(complaint, HasSubstr("3600 frames (14396 s)"));
  EXPECT_THAT(complaint, HasSubstr("set film_stride to 2"));
  EXPECT_THAT(complaint, HasSubstr("take at most 11996 s"));
  EXPECT_EQ(Import({.begin_s = 100.0, .end_s = 140.0}).views.size(), 10u);
}

TEST_F(ImportFilmTest, AcceptsDuplicateFrames) {
  ThreadPool pool(1);
  Mp4Writer writer(scratch_.path() / "film.mp4",
                   {.width = kWidth, .height = kHeight, .frames_per_second = 24});
  for (int i = 0; i < 30; ++i) writer.Add(FrameOf(1, i / 3 * 5), pool);
  writer.Finish();
  for (const View& view : Import().views) EXPECT_EQ(view.moment->shot, 0) << view.name;
  EXPECT_EQ(observer_.text, "");
}

TEST_F(ImportFilmTest, LeavesOutDamagedPart) {
  WriteVideo(90, 90);  // key frames every 2 s: 0, 20, 40, ...
  std::string bytes = ReadFile(scratch_.path() / "film.mp4");
  const size_t data = bytes.find("mdat");
  const size_t middle = data + (bytes.size() - data) / 2;
  for (size_t i = middle; i < middle + 600; ++i) bytes[i] = static_cast<char>(0x5a ^ (i * 37));
  WriteFileAtomic(scratch_.path() / "film.mp4", bytes);
  const Scene scene = Import();
  EXPECT_LT(scene.views.size(), 90u);
  EXPECT_GT(scene.views.size(), 50u);
  EXPECT_THAT(observer_.text, HasSubstr("cannot be decoded and are left out: f0000"));
  EXPECT_NEAR(scene.views.back().moment->time_s, 8.9, 1e-6) << "later frames keep their times";
}

TEST_F(ImportFilmTest, SteadiesExposure) {
  // For pictures and for a video.
  const auto exposed = [](int i) {
    Image image = FrameOf(1, i);
    for (float& v : image.data) v *= i % 2 == 0 ? 0.8f : 1.0f;
    return image;
  };
  const auto flicker = [&](const Scene& scene) {
    double sum = 0.0, last = 0.0;
    for (const View& view : scene.views) {
      EXPECT_EQ(view.image_file.substr(0, 12), "given_views/");
      const Image image = ReadImage(scratch_.path() / "out" / view.image_file);
      double mean = 0.0;
      for (size_t i = 0; i < image.PlaneSize(); ++i) mean += image.data[i];
      mean /= static_cast<double>(image.PlaneSize());
      if (&view != &scene.views[0]) sum += std::abs(mean - last);
      last = mean;
    }
    return sum / static_cast<double>(scene.views.size() - 1);
  };
  for (int i = 0; i < 16; ++i) {
    fs::create_directories(scratch_.path() / "frames");
    WriteFileAtomic(scratch_.path() / fmt::format("frames/n{:02}.jpg", i),
                    EncodeJpeg(exposed(i), 95));
  }
  EXPECT_LT(flicker(Import({.deflicker = true})), 0.02);
  EXPECT_THAT(observer_.text, HasSubstr("exposure is steadied"));
  fs::remove_all(scratch_.path() / "frames");
  ThreadPool pool(1);
  Mp4Writer writer(scratch_.path() / "film.mp4",
                   {.width = kWidth, .height = kHeight, .frames_per_second = 10});
  for (int i = 0; i < 16; ++i) writer.Add(exposed(i), pool);
  writer.Finish();
  EXPECT_LT(flicker(Import({.deflicker = true})), 0.02);
  EXPECT_GT(flicker(Import()), 0.08);
}

TEST_F(ImportFilmTest, IgnoresVideoBesidePhotos) {
  WriteVideo(3, 3);
  WriteFileAtomic(scratch_.path() / "photo.png", EncodePng8(FrameOf(1, 0)));
  EXPECT_NE(DetectCapture(ListFiles(scratch_.path())), CaptureLayout::kFilm);
}

}  // namespace
}  // namespace color3d
