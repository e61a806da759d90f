// The studio's page for films in a real browser, on a rendered film of two shots with sound: from
// the file to the coloured film, and a part of it in other colours.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <filesystem>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/image/credit/picture_credit.h"
#include "core/image/probe/probe.h"
#include "core/video/film_reader.h"
#include "core/video/mp4_writer.h"
#include "tests/integration/studio_fixture.h"
#include "tests/support/formats/sound_film.h"
#include "tests/support/scenes/wall_pan.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::Gt;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::Pair;

constexpr int kWidth = 192, kHeight = 128;
constexpr int kFramesOfShot = 14;
constexpr double kFramesPerSecond = 8.0;

// Grey. Two places of a wall, far from each other and of another contrast.
Image FilmFrame(int frame) {
  const bool second = frame >= kFramesOfShot;
  Image lab = WallPan(kWidth, kHeight, second ? 5000 + 3 * frame : frame);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (second)
        lab.At(0, y, x) = 30.0f + 40.0f * ((x / 24 + y / 24) % 2) + 0.2f * lab.At(0, y, x);
      lab.At(1, y, x) = lab.At(2, y, x) = 0.0f;
    }
  }
  return SrgbFromLab(lab);
}

class StudioFilmTest : public StudioTest {
 protected:
  std::string WriteFilm() {
    ThreadPool pool(1);
    Mp4Writer writer(Path("silent.mp4"),
                     {.width = kWidth, .height = kHeight, .frames_per_second = kFramesPerSecond});
    for (int i = 0; i < 2 * kFramesOfShot; ++i) writer.Add(FilmFrame(i), pool);
    writer.Finish();
    AddSound(Path("silent.mp4"),
             {.seconds = 2 * kFramesOfShot / kFramesPerSecond,
              .level = [](double t) { return 0.3 * std::sin(2765.0 * t); }},
             Path("walk.mp4"));
    return Path("walk.mp4");
  }
};

TEST_F(StudioFilmTest, FilmBecomesColoredAndPlays) {
  Process studio(ClientCommand({"studio", "--no-open"}), Path("studio"));
  const fs::path saved = Path("saved");
  const auto seen = Use(COLOR3D_USE_FILM, {AddressOf(studio), WriteFilm(), saved}, seconds(800));
  ASSERT_TRUE(seen.is_object());
  for (const char* none : {"errors", "requests", "wide", "faint"}) {
    EXPECT_THAT(seen.at(none), IsEmpty()) << seen.at(none);
  }
  const auto& facts = seen.at("facts");
  SCOPED_TRACE(facts.dump(1));
  const auto text = [&](const char* page) { return seen.at("texts").at(page).get<std::string>(); };
  EXPECT_THAT(text("chosen"), HasSubstr("28 frames, 3.5 s"));
  EXPECT_THAT(text("chosen"), HasSubstr("monochrome"));
  EXPECT_THAT(text("chosen"), HasSubstr("with sound"));
  EXPECT_THAT(text("chosen"), HasSubstr("2 shots"));
  EXPECT_EQ(facts.at("shots"), 2);
  EXPECT_GE(facts.at("proposals").size(), 1u) << "a frame of the other shot";
  EXPECT_NEAR(facts.at("scrubbed"), 0.5, 0.05);
  // Grey before; coloured after; grey and coloured side by side.
  EXPECT_LT(facts.at("gray").at("left"), 4.0);
  EXPECT_GT(facts.at("colored").at("left"), facts.at("gray").at("left").get<double>() + 2.0);
  EXPECT_LT(facts.at("compared").at("left"), 4.0);
  EXPECT_NEAR(facts.at("compared").at("right"), facts.at("colored").at("right"), 2.0);
  EXPECT_EQ(facts.at("steps"), 1);
  EXPECT_GE(facts.at("loops"), 10);
  EXPECT_EQ(facts.at("pause_holds"), true);
  const double before = facts.at("heap").at(0), after = facts.at("heap").at(1);
  EXPECT_LT(after, 1.05 * before + 500'000);
  // A second to either side of the frame, in its shot; then its end is dragged, and its begin moved
  // by a key.
  EXPECT_THAT(facts.at("part_first"), ElementsAre(0, 13));
  const int end = facts.at("part_dragged").at(1);
  EXPECT_LT(end, 13);
  EXPECT_THAT(facts.at("part_by_key"), ElementsAre(1, end));
  EXPECT_THAT(facts.at("part_undone"), ElementsAre(0, end));
  EXPECT_THAT(facts.at("part_kept"), ElementsAre(1, end));
  EXPECT_THAT(text("done"), HasSubstr("automatic colours"));
  EXPECT_THAT(text("again"), HasSubstr("coloured by you")) << "the part";
  // What was saved before: pictures with the credit, the movie with its sound and its frames.
  const std::string frame = ReadFile(saved / "scene_frame_000005.jpg");
  EXPECT_THAT(ReadPictureTexts(frame, "frame"),
              Contains(Pair("2:120", HasSubstr("Coloured by Erika Müller."))));
  EXPECT_EQ(ProbeImage(frame, "frame").width, kWidth);
  EXPECT_THAT(ReadPictureTexts(ReadFile(saved / "key_view_colored.png"), "key"),
              Contains(Pair("Description", HasSubstr("Coloured by Erika Müller."))));
  EXPECT_TRUE(FilmReader(saved / "scene.mp4").facts().has_sound);
  EXPECT_EQ(FilmReader(saved / "side_by_side.mp4").times().size(), 2u * kFramesOfShot);
  // Its coloured frame in grey and colour, and others.
  EXPECT_GE(facts.at("sheet").size(), 6u);
  EXPECT_THAT(facts.at("sheet"), Each(Gt(0)));
  EXPECT_THAT(text("sheet"), AllOf(HasSubstr(", coloured\n"), Not(HasSubstr("Key photo"))));
  EXPECT_THAT(text("sheet"), HasSubstr("One page of A4."));
  const v1::Job job = NewestJob("colorize_scene");
  EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED);
  const auto& part = job.spec().colorize_scene().correct_colors().corrections(0);
  EXPECT_NEAR(part.begin_s(), 1 / kFramesPerSecond, 1e-6);
  EXPECT_NEAR(part.end_s(), end / kFramesPerSecond, 1e-6);
  studio.Signal(SIGINT);
  EXPECT_EQ(studio.Wait(seconds(10)), 0) << studio.Err();
}

}  // namespace
}  // namespace color3d
