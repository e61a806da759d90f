#include "core/stage/film_import/footage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"
#include "core/video/mp4_writer.h"
#include "tests/support/formats/sound_film.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// Films of 8 s at 10 frames per second that recorded one event.
class FootageTest : public StageTest {
 protected:
  static constexpr double kSeconds = 8.0;

  // Sound of the event: syllables of a tone, of uneven strength.
  static double EventAt(double t) {
    const auto syllable = static_cast<uint64_t>(std::floor(t / 0.17));
    Random random(syllable);
    const double strength = std::pow(10.0, -2.0 * random.NextUniform());
    return 0.5 * strength * std::sin(2.0 * M_PI * 330.0 * t);
  }
  void WriteFilm(const std::string& name, double began_s, bool with_sound = true) {
    ThreadPool pool(1);
    const fs::path silent = scratch_.path() / "silent.mp4";
    Mp4Writer writer(silent, {.width = 64, .height = 48, .frames_per_second = 10});
    for (int i = 0; i < 10 * kSeconds; ++i) writer.Add(Image(64, 48, 3, 0.5f), pool);
    writer.Finish();
    const fs::path file = scratch_.path() / name;
    if (!with_sound) return fs::rename(silent, file);
    GivenSound sound;
    sound.seconds = kSeconds;
    sound.level = [&](double t) { return EventAt(began_s + t); };
    AddSound(silent, sound, file);
    fs::remove(silent);
  }
  std::vector<Footage> Read() {
    observer_.text.clear();
    StageContext context = MakeContext();
    return ReadFootage({}, context);
  }
};

TEST_F(FootageTest, AlignsFilmsBySound) {
  WriteFilm("a.mp4", 2.0);
  WriteFilm("b.mp4", 4.5);
  WriteFilm("c.mp4", 0.8);
  WriteFilm("0.mp4", 0.0, /*with_sound=*/false);
  std::vector<Footage> all = Read();
  ASSERT_EQ(all.size(), 4u);
  EXPECT_EQ(all[0].film.file, "0.mp4");
  all.erase(all.begin());
  EXPECT_NEAR(all[0].times[0], 1.2, 0.03);
  EXPECT_NEAR(all[1].times[0], 3.7, 0.03);
  EXPECT_NEAR(all[2].times[0], 0.0, 0.03);
  EXPECT_THAT(observer_.text, HasSubstr("by their sound, b.mp4 began 2.50 s after a.mp4"));
  EXPECT_THAT(observer_.text, HasSubstr("by their sound, c.mp4 began 1.20 s before a.mp4"));
}

TEST_F(FootageTest, PrefersOffsetsOfTransforms) {
  WriteFilm("a.mp4", 2.0);
  WriteFilm("b.mp4", 4.5);
  WriteFileAtomic(scratch_.path() / "transforms.json",
                  R"({"frames":[{"file_path":"a.mp4"},{"file_path":"b.mp4","time_offset":1.0}]})");
  EXPECT_NEAR(Read()[1].times[0], 1.0, 1e-6);
  EXPECT_EQ(observer_.text.find("by their sound"), std::string::npos);
}

TEST_F(FootageTest, AssumesCommonStartWithoutCommonSound) {
  WriteFilm("a.mp4", 2.0);
  WriteFilm("b.mp4", 200.0);
  WriteFilm("c.mp4", 0.0, /*with_sound=*/false);
  const std::vector<Footage> all = Read();
  ASSERT_EQ(all.size(), 3u);
  for (const Footage& footage : all) EXPECT_NEAR(footage.times[0], 0.0, 1e-6);
  EXPECT_THAT(observer_.text, HasSubstr("a.mp4 and b.mp4 have no sound in common"));
  EXPECT_EQ(observer_.text.find("c.mp4"), std::string::npos);
}

}  // namespace
}  // namespace color3d
