// Films through the service: coloured frames and a movie, or a message of one line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/video/film_reader.h"
#include "core/video/mp4_writer.h"
#include "tests/integration/service_fixture.h"
#include "tests/support/formats/sound_film.h"
#include "tests/support/scenes/test_scenes.h"
#include "tests/support/scenes/textured_corner.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kWidth = 192, kHeight = 128, kFrames = 17;

// A camera pans over a red and green wall, in front of which a blue object moves.
Image FrameOf(int frame) {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double u = x + 1.5 * frame, v = y;
      double l = 0.45;
      for (int k = 1; k <= 5; ++k) {
        const double a = 1.9 * k;
        l += 0.05 * std::sin(0.12 * k * (u * std::cos(a) + v * std::sin(a)) + 2.7 * a);
      }
      const double red = 0.5 + 0.4 * std::sin(0.025 * u);
      double rgb[] = {l * (0.6 + 0.6 * red), l * (1.2 - 0.6 * red), 0.8 * l};
      if (std::hypot(x - 40.0 - 5.0 * frame, y - 70.0) < 22.0) {
        const double spots = 0.5 + 0.15 * std::sin(0.5 * (x - 5 * frame)) * std::sin(0.45 * y);
        rgb[0] = 0.45 * spots, rgb[1] = 0.6 * spots, rgb[2] = 1.4 * spots;
      }
      for (int c = 0; c < 3; ++c) image.At(c, y, x) = static_cast<float>(rgb[c]);
    }
  }
  return image;
}

class FilmTest : public ServiceTest {
 protected:
  void SetUp() override { StartServer(); }

  void WriteFrames() {
    fs::create_directories(Path("frames"));
    for (int i = 0; i < kFrames; ++i) {
      const std::string number = std::to_string(100 + i);
      WriteFileAtomic(Path("frames") / ("n" + number + ".png"), EncodePng8(FrameOf(i)));
    }
  }
  // In front of it an object moves.
  void WriteFramesOfAStillCamera() {
    fs::create_directories(Path("frames"));
    const Camera camera{320, 240, 330.0, 330.0, 160.0, 120.0};
    for (int i = 0; i < 6; ++i) {
      const Image gray = RenderCorner(camera,
                                      LookAt({0.5, -0.1, -1.3}, {0.1, 0.4, 1.6}),
                                      MovingBoard{{0.3 - 0.025 * i, 0.3 - 0.02 * i, 0.9}});
      WriteFileAtomic(Path("frames") / ("n" + std::to_string(i) + ".png"), EncodePng8(gray));
    }
  }
  fs::path WriteVideo() {
    ThreadPool pool(1);
    Mp4Writer writer(Path("walk.mp4"),
                     {.width = kWidth, .height = kHeight, .frames_per_second = 12});
    for (int i = 0; i < kFrames; ++i) writer.Add(FrameOf(i), pool);
    writer.Finish();
    return Path("walk.mp4");
  }
  ProcessResult Colorize(const fs::path& film, const std::vector<std::string>& more) {
    return Client(std::vector<std::string>{"colorize", film.string(), "-o", Path("out").string()} +
                  QuickOptions() + more);
  }
};

TEST_F(FilmTest, ColorsFoldersOfFrames) {
  WriteFrames();
  const ProcessResult result =
      Colorize(Path("frames"), {"--film", "--benchmark", "--key-view", "n109", "--png"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.err, HasSubstr("coloured, not reconstructed"));
  const auto metrics = nlohmann::json::parse(ReadFile(Path("out") / "metrics.json"));
  const double error = metrics.at("delta_e00_chroma"), gray = metrics.at("delta_e00_gray");
  std::printf("chroma error %.2f, grey %.2f\n", error, gray);
  EXPECT_LT(error, 0.35 * gray);
  EXPECT_GT(metrics.at("psnr_l"), 45.0) << "the luminance is the film's own";
  FilmReader movie(Path("out") / "scene.mp4");
  EXPECT_EQ(movie.times().size(), static_cast<size_t>(kFrames));
  EXPECT_EQ(movie.facts().width, kWidth);
  for (int i = 0; i < kFrames; ++i) {
    const std::string name = "n" + std::to_string(100 + i) + ".png";
    const Image picture = ReadImage(Path("out") / "film_frames" / name);
    EXPECT_EQ(picture.width, kWidth);
    EXPECT_EQ(picture.channels, 3) << name;
  }
  EXPECT_THAT(result.out, HasSubstr("film_frames/"));
  EXPECT_TRUE(fs::exists(Path("out") / "report.html"));
  EXPECT_FALSE(fs::exists(Path("out") / "scene.ply"));
  const ProcessResult turned = Client({"turntable", Path("out").string()});
  EXPECT_EQ(turned.exit_code, 2);
  EXPECT_THAT(turned.err, HasSubstr("coloured without poses, so no camera can move through it"));
}

TEST_F(FilmTest, BenchmarkTakesAFilm) {
  const ProcessResult result =
      Colorize(WriteVideo(),
               {"--benchmark", "--key-view", "f000009", "--set", "import_scene.film_end_s=1.2"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const auto metrics = nlohmann::json::parse(ReadFile(Path("out") / "metrics.json"));
  const double error = metrics.at("delta_e00_chroma"), gray = metrics.at("delta_e00_gray");
  std::printf("chroma error %.2f, grey %.2f\n", error, gray);
  EXPECT_LT(error, 0.5 * gray);
  const FilmReader movie(Path("out") / "scene.mp4");
  ASSERT_EQ(movie.times().size(), 15u);
  EXPECT_NEAR(movie.times()[12], 1.0, 1e-3) << "at the film's own rate, 12 a second";
}

TEST_F(FilmTest, NamesCopiesOfAFilm) {
  fs::create_directories(Path("films"));
  fs::rename(WriteVideo(), Path("films") / "walk.mp4");
  fs::copy_file(Path("films") / "walk.mp4", Path("films") / "walk (1).mp4");
  const ProcessResult result =
      Client({"key", "select", Path("films").string(), "-o", Path("key").string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("walk (1).mp4 is the same film as walk.mp4"));
}

TEST_F(FilmTest, EstimatesPosesOnRequestOnly) {
  WriteFramesOfAStillCamera();
  const ProcessResult refused = Colorize(Path("frames"), {"--poses"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--poses is for films"));
  const ProcessResult still = Colorize(Path("frames"), {"--film", "--poses"});
  EXPECT_EQ(still.exit_code, 0) << still.err;
  EXPECT_THAT(still.err, HasSubstr("the camera stands still"));
  EXPECT_THAT(still.err, HasSubstr("the scene is a relief (2.5D) with assumed depth"));
  const ProcessResult off = Colorize(Path("frames"), {"--film"});
  EXPECT_EQ(off.exit_code, 0) << off.err;
  EXPECT_EQ(off.err.find("stands still"), std::string::npos);
}

TEST_F(FilmTest, AcceptedKeyViewKeepsThePosesOption) {
  WriteFramesOfAStillCamera();
  const std::string key = Path("key").string();
  const ProcessResult select = Client({"key",
                                       "select",
                                       Path("frames").string(),
                                       "--film",
                                       "--poses",
                                       "--set",
                                       "import_scene.film_frames_per_second=16",
                                       "-o",
                                       key});
  ASSERT_EQ(select.exit_code, 0) << select.out << select.err;
  EXPECT_THAT(select.err, HasSubstr("the camera stands still"));
  EXPECT_THAT(select.out, HasSubstr("--poses --set import_scene.film_frames_per_second=16"));
  const std::string scene = NewestJob("select_key_view").spec().scene();
  ASSERT_EQ(Client({"key", "color", scene, "--auto", "-o", key}).exit_code, 0);
  ASSERT_EQ(Client({"key", "accept", scene}).exit_code, 0);
  const std::vector<std::string> colorize = {
      "colorize", "--scene", scene, "-o", Path("out").string()};
  const ProcessResult again = Client(colorize + std::vector<std::string>{"--poses"});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("--poses were fixed when the key view was selected"));
  const ProcessResult result = Client(colorize + QuickOptions());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, testing::Not(HasSubstr("frames of a film without poses")));
  EXPECT_NEAR(FilmReader(Path("out") / "film.mp4").times().at(1), 1 / 16.0, 1e-3);
  EXPECT_TRUE(fs::exists(Path("out") / "scene.ply"));
  EXPECT_TRUE(fs::exists(Path("out") / "film.mp4"));
  EXPECT_THAT(ReadFile(Path("out") / "plan.json"), HasSubstr("2.5D: depth is assumed"));
  EXPECT_THAT(ReadFile(Path("out") / "report.html"), HasSubstr("2.5D"));
  const ProcessResult turned =
      Client({"turntable", Path("out").string(), "-o", Path("turned.mp4").string()});
  EXPECT_EQ(turned.exit_code, 0) << turned.err;
}

TEST_F(FilmTest, SeparatePersonalizeJobTrainsAtFrameSize) {
  WriteFrames();
  const std::string key = Path("key").string();
  ASSERT_EQ(Client({"key", "select", Path("frames").string(), "--film", "-o", key}).exit_code, 0);
  const std::string scene = NewestJob("select_key_view").spec().scene();
  ASSERT_EQ(Client({"key", "color", scene, "--auto", "-o", key}).exit_code, 0);
  v1::JobSpec spec;
  spec.set_scene(scene);
  spec.mutable_personalize()->set_iterations(2);
  for (const char* kind : {"import_scene", "select_key_view", "colorize_key_view"}) {
    spec.add_inputs(NewestJob(kind).name());
  }
  const std::string folder = Path("colorizer").string();
  const ProcessResult got = Client({"artifact", "download", RunJob(spec), "-o", folder});
  ASSERT_EQ(got.exit_code, 0) << got.err;
  EXPECT_THAT(ReadFile(Path("colorizer") / "colorizer.c3c"), HasSubstr(R"(max_side_px\":500)"));
}

TEST_F(FilmTest, ColorsAVideoFromOnePaintedFrame) {
  const fs::path film = WriteVideo();
  const ProcessResult select = Colorize(film, {});
  ASSERT_EQ(select.exit_code, 0) << select.err;
  EXPECT_THAT(select.err, HasSubstr("the film walk.mp4"));
  const auto selected = nlohmann::json::parse(ReadFile(Path("out") / "key_view.json"));
  EXPECT_EQ(selected.at("view").get<std::string>().substr(0, 3), "f00");
  WriteFileAtomic(Path("painted.png"), EncodePng8(FrameOf(6)));
  const ProcessResult result = Colorize(film,
                                        {"--key-view",
                                         "f000006",
                                         "--key-color",
                                         Path("painted.png").string(),
                                         "--set",
                                         "import_scene.film_end_s=1.05"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  FilmReader movie(Path("out") / "scene.mp4");
  ASSERT_EQ(movie.times().size(), 13u);
  EXPECT_NEAR(movie.times()[1], 1.0 / 12.0, 0.01);
  // The moving object stays blue to the end.
  for (const int frame : {0, 12}) {
    const Image image = movie.Read(frame);
    const int x = 40 + 5 * frame;
    EXPECT_GT(image.At(2, 70, x), image.At(0, 70, x) + 0.15f) << frame;
  }
}

// Only the left half, with the moving object, is painted; the rest is open.
TEST_F(FilmTest, PartlyPaintedFrameColorsOnlyItsPaint) {
  WriteFrames();
  const Image truth = FrameOf(6);
  Image painted(kWidth, kHeight, 4);
  std::copy(truth.data.begin(), truth.data.end(), painted.data.begin());
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth / 2; ++x) painted.At(3, y, x) = 1.0f;
  }
  WriteFileAtomic(Path("half.png"), EncodePng8(painted));
  const ProcessResult result = Colorize(
      Path("frames"), {"--film", "--key-view", "n106", "--key-color", Path("half.png").string()});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  FilmReader movie(Path("out") / "scene.mp4");
  for (const int frame : {0, 6, 13}) {
    const Image image = movie.Read(frame);
    const int x = 40 + 5 * frame;
    EXPECT_GT(image.At(2, 70, x), image.At(0, 70, x) + 0.15f) << frame;
    // The wall of the painted half, as far as it is visible here.
    const int wall = 39 - 3 * frame / 2;
    const Image truth_here = FrameOf(frame);
    EXPECT_NEAR(image.At(0, 20, wall) - image.At(1, 20, wall),
                truth_here.At(0, 20, wall) - truth_here.At(1, 20, wall),
                0.08)
        << frame;
  }
}

TEST_F(FilmTest, RecolorsATimeRangeAndReusesTheRest) {
  WriteFrames();
  WriteFileAtomic(Path("painted.png"), EncodePng8(FrameOf(8)));
  Image red = FrameOf(12);
  std::swap_ranges(red.Plane(0), red.Plane(1), red.Plane(2));  // blue becomes red
  WriteFileAtomic(Path("red.png"), EncodePng8(red));
  const std::vector<std::string> film = {
      "--film", "--key-view", "n108", "--key-color", Path("painted.png").string()};
  const auto with = [&](const std::string& range) {
    std::vector<std::string> arguments = film;
    arguments.insert(arguments.end(),
                     {"--add-key-view", "n112=" + Path("red.png").string() + range});
    return Colorize(Path("frames"), arguments);
  };
  const ProcessResult before = Colorize(Path("frames"), film);
  ASSERT_EQ(before.exit_code, 0) << before.err;
  // Colours and their sources of all frames, before any is recoloured.
  const auto colored = [&] {
    std::map<std::string, std::string> digests;
    const v1::Job job = NewestJob("colorize_views");
    for (const v1::Artifact& artifact : job.artifacts()) {
      digests[artifact.name()] = artifact.digest().sha256();
    }
    return digests;
  };
  const auto colored_before = colored();
  EXPECT_EQ(colored_before.size(), 2u * kFrames);
  const ProcessResult after = with("@0.4-0.56");
  ASSERT_EQ(after.exit_code, 0) << after.out << after.err;
  EXPECT_EQ(colored(), colored_before);
  const v1::Job recolored = NewestJob("correct_colors");
  int frames = 0;
  for (const v1::Artifact& artifact : recolored.artifacts()) {
    if (artifact.name().find("corrected_ab/") == std::string::npos) continue;
    ++frames;
    EXPECT_THAT(artifact.name(), testing::ContainsRegex("n11[0-4].png"));
  }
  EXPECT_EQ(frames, 5);
  const std::string report = ReadFile(Path("out") / "report.html");
  EXPECT_THAT(report, HasSubstr("n112.png=COLOURED_1.png@0.4-0.56"));
  EXPECT_THAT(report, HasSubstr("<h2>Additional key view</h2>"));
  FilmReader movie(Path("out") / "scene.mp4");
  for (int frame = 0; frame < kFrames; ++frame) {
    const Image image = movie.Read(frame);
    const int x = 40 + 5 * frame;
    const float bluer = image.At(2, 70, x) - image.At(0, 70, x);
    if (frame >= 10 && frame <= 14) {
      EXPECT_LT(bluer, -0.1f) << frame;
    } else {
      EXPECT_GT(bluer, 0.1f) << frame;
    }
  }
  const std::pair<const char*, const char*> refused[] = {
      {"@0.5-0.4", "before it begins"},
      {"@0.5-0.6", "n112.png is shown at 0.480 s, outside of its range"},
      {"@0.4-7", "reaches out of the film, which is coloured from 0.000 s to 0.680 s"}};
  for (const auto& [range, complaint] : refused) {
    const ProcessResult result = with(range);
    EXPECT_NE(result.exit_code, 0);
    EXPECT_THAT(result.err, HasSubstr(complaint));
  }
  std::vector<std::string> as_photos = film;
  as_photos[0] = "--add-key-view=n112=auto@0.4-0.56";
  EXPECT_THAT(Colorize(Path("frames"), as_photos).err, HasSubstr("is for films without poses"));
}

TEST_F(FilmTest, SelectionTakesFramesOfAFilm) {
  WriteFrames();
  const ProcessResult select = Client({"key",
                                       "select",
                                       Path("frames").string(),
                                       "--film",
                                       "--deflicker",
                                       "--count",
                                       "2",
                                       "-o",
                                       Path("key").string()});
  ASSERT_EQ(select.exit_code, 0) << select.out << select.err;
  EXPECT_THAT(select.err, testing::Not(HasSubstr("exposure is steadied"))) << "none jumps";
  EXPECT_THAT(select.err, HasSubstr("exposure is steady"));
  const auto selected = nlohmann::json::parse(ReadFile(Path("key") / "key_view.json"));
  EXPECT_EQ(selected.at("key_views").size(), 2u);
  const ProcessResult create = Client({"scene", "create", Path("frames").string(), "--film"});
  ASSERT_EQ(create.exit_code, 0) << create.err;
  const ProcessResult list = Client({"scene", "list"});
  EXPECT_THAT(list.out, HasSubstr("film"));
  EXPECT_THAT(list.out, testing::Not(HasSubstr("ACTIVE  photos")));
  const ProcessResult stored =
      Client({"key", "select", create.out.substr(0, create.out.find('\n')), "--film"});
  EXPECT_NE(stored.exit_code, 0);
  EXPECT_THAT(stored.err, HasSubstr("--film is for a folder"));
}

TEST_F(FilmTest, KeepsSoundAndUnevenTimes) {
  ThreadPool pool(1);
  Mp4Writer writer(
      Path("silent.mp4"),
      {.width = kWidth, .height = kHeight, .frames_per_second = 12, .ticks_per_second = 24000});
  std::vector<double> times;
  for (int i = 0; i < kFrames; ++i) {
    times.push_back(i < 8 ? i / 24.0 : i / 8.0 - 2.0 / 3.0);
    writer.AddAt(times.back(), 0.125, FrameOf(i), pool);
  }
  writer.Finish();
  const auto tone = [](double s) { return s < 0.5 ? 0.0 : 0.5 * std::sin(2500.0 * s); };
  AddSound(Path("silent.mp4"), {.seconds = times.back() + 0.1, .level = tone}, Path("heard.mp4"));
  const ProcessResult result = Colorize(Path("heard.mp4"), {"--auto"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  FilmReader movie(Path("out") / "scene.mp4");
  ASSERT_EQ(movie.times().size(), times.size());
  for (size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(movie.times()[i], times[i], 1e-6) << i;
  const HeardSound sound = HearFilm(Path("out") / "scene.mp4");
  EXPECT_EQ(sound.codec, "aac");
  size_t onset = 0;
  while (onset < sound.samples.size() && std::abs(sound.samples[onset]) < 0.15f) ++onset;
  EXPECT_NEAR(static_cast<double>(onset) / sound.sample_rate, 0.5, 0.01);
}

TEST_F(FilmTest, RefusesFilesThatAreNoFilm) {
  WriteFileAtomic(Path("text.mp4"), "this is no film");
  const ProcessResult text = Colorize(Path("text.mp4"), {"--auto"});
  EXPECT_NE(text.exit_code, 0);
  EXPECT_THAT(text.err, HasSubstr("text.mp4 is no film that can be read"));
  EXPECT_THAT(text.err, HasSubstr("try another copy, or save it as .mp4"));
  const ProcessResult inspected = Client({"inspect", Path("text.mp4").string()});
  EXPECT_EQ(inspected.exit_code, 2);
  EXPECT_THAT(inspected.err, HasSubstr("text.mp4 is a film; inspect needs pictures"));
  const fs::path film = WriteVideo();
  const ProcessResult none =
      Colorize(film, {"--benchmark", "--set", "import_scene.film_end_s=0.1"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("2 frames before 0.1 s"));
  const ProcessResult late = Colorize(film, {"--auto", "--set", "import_scene.film_begin_s=60"});
  EXPECT_NE(late.exit_code, 0);
  EXPECT_THAT(late.err, HasSubstr("it lasts"));
}

}  // namespace
}  // namespace color3d
