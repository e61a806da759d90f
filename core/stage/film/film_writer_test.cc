#include "core/stage/film/film_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/stage/formats/artifact_io.h"
#include "core/stage/options/film_options.h"
#include "core/video/film_reader.h"
#include "core/video/mp4_writer.h"
#include "tests/support/formats/movie_reader.h"
#include "tests/support/formats/sound_film.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int kWidth = 64, kHeight = 48;

Image FrameOf(int frame) {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double u = x + 0.4 * frame;
      const double v = 0.5 + 0.2 * std::sin(0.3 * u + 0.1 * y) + 0.15 * std::sin(0.23 * y);
      for (int c = 0; c < 3; ++c) image.At(c, y, x) = static_cast<float>(v);
    }
  }
  return image;
}

// Silence, then a tone from a given time on.
double ToneFrom2s(double time_s) { return time_s < 2.0 ? 0.0 : 0.6 * std::sin(3000.0 * time_s); }

double OnsetOf(const HeardSound& sound) {
  for (size_t i = 0; i < sound.samples.size(); ++i) {
    if (std::abs(sound.samples[i]) > 0.15f) return static_cast<double>(i) / sound.sample_rate;
  }
  return -1.0;
}

class FilmWriterTest : public StageTest {
 protected:
  void WriteFilm(const std::vector<double>& times, const std::string& encoder) {
    ScratchFolder elsewhere;
    ThreadPool pool(1);
    Mp4Writer writer(
        elsewhere.path() / "silent.mp4",
        {.width = kWidth, .height = kHeight, .frames_per_second = 10, .ticks_per_second = 24000});
    for (size_t i = 0; i < times.size(); ++i) {
      writer.AddAt(times[i], 0.1, FrameOf(static_cast<int>(i)), pool);
    }
    writer.Finish();
    const GivenSound sound{.encoder = encoder, .seconds = times.back() + 0.1, .level = ToneFrom2s};
    AddSound(elsewhere.path() / "silent.mp4", sound, scratch_.path() / "film.mov");
  }
  // Imports, colours uniformly, and writes the movie.
  fs::path Colored(const FilmOptions& options = {}) {
    inputs_.clear();
    fs::remove_all(scratch_.path() / "out");
    fs::remove_all(scratch_.path() / "given_views");
    {
      StageContext context = MakeContext();
      RunImportScene({}, context, {}, options);
    }
    fs::rename(scratch_.path() / "out/given_views", scratch_.path() / "given_views");
    scene_ = SceneFromJson(ReadFile(scratch_.path() / "out/scene.json"));
    AddInput(artifact::kScene, SceneToJson(scene_));
    for (const View& view : scene_.views) {
      AddInput(ViewArtifact(artifact::kViewsAb, view),
               EncodeAbPng(Image(kWidth, kHeight, 2, 20.0f)));
    }
    StageContext context = MakeContext();
    RunRender({.max_views = 2}, context);
    return scratch_.path() / "out/scene.mp4";
  }
  // Two frames, 0.5 s apart, of each of two posed cameras, coloured uniformly.
  void MakeRig() {
    for (const char* camera : {"left", "right"}) {
      for (int i = 0; i < 2; ++i) {
        View view;
        view.name = std::string(camera) + "/f00000" + std::to_string(i) + ".png";
        view.image_file = artifact::kGivenViews + view.name;
        view.camera = view.captured_camera = {kWidth, kHeight, 60.0, 60.0, 32.0, 24.0};
        view.cam_from_world.translation = {camera[0] == 'l' ? 0.0 : 0.1, 0.0, 0.0};
        view.moment = Moment{0.5 * i, camera[0] == 'l' ? 0 : 1};
        fs::create_directories((scratch_.path() / view.image_file).parent_path());
        WriteFileAtomic(scratch_.path() / view.image_file, EncodePng8(FrameOf(i)));
        AddInput(ViewArtifact(artifact::kViewsAb, view),
                 EncodeAbPng(Image(kWidth, kHeight, 2, 20.0f)));
        scene_.views.push_back(view);
      }
    }
    AddInput(artifact::kScene, SceneToJson(scene_));
    AddInput(artifact::kKeyView, R"({"view": "right/f000001.png"})");
    AddInput(artifact::kKeyColor, EncodeAbPng(Image(kWidth, kHeight, 2, 20.0f)));
    AddInput(artifact::kModel, SerializeGaussians(BallBeforeWall(0.0, 0.5)));
  }

  Scene scene_;
};

std::vector<double> UnevenTimes() {
  std::vector<double> times = {0.0};
  for (int i = 1; i < 40; ++i) times.push_back(times.back() + (i % 7 < 3 ? 1 / 24.0 : 1 / 8.0));
  return times;
}

TEST_F(FilmWriterTest, KeepsTimesAndSoundOfFilm) {
  const std::vector<double> times = UnevenTimes();
  ASSERT_GT(times.back(), 3.0);
  WriteFilm(times, "aac");
  const fs::path movie = Colored();
  FilmReader film(movie);
  ASSERT_EQ(film.times().size(), times.size());
  for (size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(film.times()[i], times[i], 1e-6) << i;
  const HeardSound sound = HearFilm(movie);
  EXPECT_EQ(sound.codec, "aac");
  EXPECT_NEAR(OnsetOf(sound), 2.0, 0.01);
  EXPECT_NEAR(
      static_cast<double>(sound.samples.size()) / sound.sample_rate, times.back() + 0.1, 0.08);
  const Image frame = film.Read(20);
  EXPECT_GT(frame.At(0, 24, 32), frame.At(1, 24, 32) + 0.05f) << "in colour";
  EXPECT_EQ(observer_.text, "");
}

TEST_F(FilmWriterTest, KeepsSoundInStepWithPartOfFilm) {
  const std::vector<double> times = UnevenTimes();
  WriteFilm(times, "pcm_s16le");
  const fs::path movie = Colored({.stride = 2, .begin_s = 1.0, .end_s = 3.0});
  FilmReader film(movie);
  ASSERT_EQ(film.times().size(), scene_.views.size());
  const double begin = scene_.views[0].moment->time_s;
  EXPECT_GE(begin, 1.0);
  for (size_t i = 0; i < film.times().size(); ++i) {
    const int frame = std::stoi(scene_.views[i].name.substr(1));
    EXPECT_NEAR(film.times()[i] + begin, times[frame], 1e-6) << i;
  }
  const HeardSound sound = HearFilm(movie);
  EXPECT_EQ(sound.codec, "aac");
  EXPECT_NEAR(OnsetOf(sound), 2.0 - begin, 0.01);
}

TEST_F(FilmWriterTest, WritesFramesAsPictures) {
  const std::vector<double> times = {0.0, 0.1, 0.2, 0.3, 0.4};
  WriteFilm(times, "aac");
  Colored({.stride = 2});
  EXPECT_FALSE(fs::exists(scratch_.path() / "out/film_frames")) << "only on request";
  fs::remove_all(scratch_.path() / "out");
  StageContext context = MakeContext();
  RunRender({.max_views = 2, .pictures = true}, context);
  const ReadMovie movie = DecodeMovie(scratch_.path() / "out/scene.mp4");
  ASSERT_GE(scene_.views.size(), 2u);
  ASSERT_EQ(movie.frames.size(), scene_.views.size());
  for (size_t i = 0; i < scene_.views.size(); ++i) {
    const std::string name = "film_frames/f00000" + std::to_string(2 * i) + ".png";
    EXPECT_THAT(context.outputs(), testing::Contains(name));
    const Image picture = ReadImage(scratch_.path() / "out" / name);
    ASSERT_EQ(picture.width, kWidth);
    ASSERT_EQ(picture.height, kHeight);
    double error = 0.0;
    for (size_t k = 0; k < picture.data.size(); ++k) {
      error += std::abs(picture.data[k] - movie.frames[i].data[k]);
    }
    EXPECT_LT(error / static_cast<double>(picture.data.size()), 0.01) << name;
  }
}

TEST_F(FilmWriterTest, KeepsSizeOfWideScansInPictures) {
  constexpr int kWide = 8210, kTall = 31;
  fs::create_directories(scratch_.path() / "frames");
  for (int i = 0; i < 2; ++i) {
    WriteFileAtomic(scratch_.path() / "frames" / ("n" + std::to_string(i) + ".png"),
                    EncodePng8(Image(kWide, kTall, 3, 0.3f + 0.2f * i)));
  }
  {
    StageContext context = MakeContext();
    RunImportScene({}, context);
  }
  scene_ = SceneFromJson(ReadFile(scratch_.path() / "out/scene.json"));
  AddInput(artifact::kScene, SceneToJson(scene_));
  for (const View& view : scene_.views) {
    AddInput(ViewArtifact(artifact::kViewsAb, view), EncodeAbPng(Image(kWide, kTall, 2, 20.0f)));
  }
  StageContext context = MakeContext();
  RunRender({.max_views = 2, .pictures = true}, context);
  const FilmReader movie(scratch_.path() / "out/scene.mp4");
  EXPECT_EQ(movie.times().size(), 2u);
  EXPECT_EQ(movie.facts().width, 8192);
  EXPECT_EQ(movie.facts().height, 30);
  const Image picture = ReadImage(scratch_.path() / "out/film_frames/n1.png");
  EXPECT_EQ(picture.width, kWide);
  EXPECT_EQ(picture.height, kTall);
}

TEST_F(FilmWriterTest, WritesFilmOfEachCamera) {
  MakeRig();
  WriteFilm({0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0}, "aac");
  ImportFacts facts;
  facts.layout = CaptureLayout::kPosedFilms;
  facts.cameras = {{"in the/left", ""}, {"in the_left", "film.mov"}};
  AddInput(artifact::kImportFacts, ImportFactsToJson(facts));
  StageContext context = MakeContext();
  RunRender({.pictures = true}, context);
  const fs::path out = scratch_.path() / "out";
  for (const char* name : {"films/in_the_left.mp4", "films/in_the_left_2.mp4", "scene.mp4"}) {
    FilmReader film(out / name);
    ASSERT_EQ(film.times().size(), 2u) << name;
    EXPECT_NEAR(film.times()[1], 0.5, 1e-6) << name;
  }
  EXPECT_EQ(ReadFile(out / "film.mp4"), ReadFile(out / "films/in_the_left_2.mp4"));
  EXPECT_NE(ReadFile(out / "film.mp4"), ReadFile(out / "films/in_the_left.mp4"));
  EXPECT_EQ(HearFilm(out / "films/in_the_left.mp4").codec, "");
  EXPECT_EQ(HearFilm(out / "film.mp4").codec, "aac");
  EXPECT_EQ(HearFilm(out / "scene.mp4").codec, "aac") << "sound of the camera of the key view";
  for (const View& view : scene_.views) {
    EXPECT_EQ(ReadImage(out / ("film_frames/" + view.name)).width, kWidth) << view.name;
  }
  EXPECT_FALSE(fs::exists(out / "frames"));
}

TEST_F(FilmWriterTest, KeepsHalfSecondsOfColmapScene) {
  MakeRig();
  ImportFacts facts;
  facts.layout = CaptureLayout::kColmap;
  facts.cameras = {{"left", ""}, {"right", ""}};
  AddInput(artifact::kImportFacts, ImportFactsToJson(facts));
  StageContext context = MakeContext();
  RunRender({}, context);
  FilmReader film(scratch_.path() / "out/film.mp4");
  ASSERT_EQ(film.times().size(), 2u);
  EXPECT_NEAR(film.times()[1], 0.5, 1e-6);
}

TEST_F(FilmWriterTest, WritesFilmOfStaticScene) {
  MakeRig();
  AddInput(artifact::kModel, SerializeGaussians(SmallModel()));
  StageContext context = MakeContext();
  RunRender({}, context);
  EXPECT_EQ(FilmReader(scratch_.path() / "out/film.mp4").times().size(), 2u);
  EXPECT_FALSE(fs::exists(scratch_.path() / "out/scene.mp4"));
}

TEST_F(FilmWriterTest, RenderedPathKeepsSound) {
  const std::vector<double> times = UnevenTimes();
  WriteFilm(times, "aac");
  Colored({.begin_s = 1.0});
  for (size_t i = 0; i < scene_.views.size(); ++i) {
    scene_.views[i].cam_from_world.translation.x() = 0.01 * static_cast<double>(i);
  }
  AddInput(artifact::kScene, SceneToJson(scene_));
  AddInput(artifact::kKeyView, R"({"view": ")" + scene_.views[3].name + "\"}");
  const double begin_s = scene_.views.front().time_s(), end_s = scene_.views.back().time_s();
  AddInput(artifact::kModel, SerializeGaussians(BallBeforeWall(begin_s, end_s)));
  for (const auto path : {RenderOptions::Path::kPhotos, RenderOptions::Path::kStill}) {
    fs::remove_all(scratch_.path() / "out");
    StageContext context = MakeContext();
    RunRender({.path = path}, context);
    FilmReader film(scratch_.path() / "out/scene.mp4");
    ASSERT_EQ(film.times().size(), scene_.views.size());
    for (size_t i = 0; i < film.times().size(); ++i) {
      EXPECT_NEAR(film.times()[i], scene_.views[i].time_s() - begin_s, 1e-6) << i;
    }
    EXPECT_NEAR(OnsetOf(HearFilm(scratch_.path() / "out/scene.mp4")), 2.0 - begin_s, 0.01);
  }
  fs::remove_all(scratch_.path() / "out");
  StageContext back = MakeContext();
  RunRender({.path = RenderOptions::Path::kStill, .bounce = true}, back);
  EXPECT_EQ(HearFilm(scratch_.path() / "out/scene.mp4").codec, "");
}

TEST_F(FilmWriterTest, NamesSoundThatIsLeftOut) {
  ScratchFolder elsewhere;
  WriteFilm(UnevenTimes(), "aac");
  ThreadPool pool(1);
  Mp4Writer writer(elsewhere.path() / "silent.mp4",
                   {.width = kWidth, .height = kHeight, .frames_per_second = 10});
  for (int i = 0; i < 10; ++i) writer.Add(FrameOf(i), pool);
  writer.Finish();
  const GivenSound odd{.encoder = "pcm_s16le", .sample_rate = 37000, .level = ToneFrom2s};
  AddSound(elsewhere.path() / "silent.mp4", odd, scratch_.path() / "film.mov");
  EXPECT_EQ(HearFilm(Colored()).codec, "");
  EXPECT_THAT(observer_.text, HasSubstr("sound (pcm_s16le) is left out"));
}

}  // namespace
}  // namespace color3d
