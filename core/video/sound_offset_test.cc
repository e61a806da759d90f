#include "core/video/sound_offset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/random.h"
#include "core/video/film_reader.h"
#include "tests/support/formats/sound_film.h"

namespace color3d {
namespace {

// Like speech: syllables of uneven strength, a hundred levels per second.
std::vector<float> Talk(uint64_t seed, int count) {
  Random random(seed);
  std::vector<float> levels;
  while (static_cast<int>(levels.size()) < count) {
    const int length = 5 + static_cast<int>(random.NextBelow(25));
    const auto level = static_cast<float>(-5.0 + 3.0 * random.NextUniform());
    for (int i = 0; i < length; ++i) levels.push_back(level);
  }
  levels.resize(count);
  return levels;
}

std::vector<float> Noisy(std::vector<float> levels, uint64_t seed, double noise) {
  Random random(seed);
  for (float& level : levels) level += static_cast<float>(noise * (random.NextUniform() - 0.5));
  return levels;
}

std::vector<float> Part(const std::vector<float>& levels, int begin, int end) {
  return {levels.begin() + begin, levels.begin() + end};
}

TEST(SoundOffsetTest, FindsPositiveAndNegativeOffsetsInNoise) {
  const std::vector<float> event = Talk(1, 3000);
  const auto one = Noisy(Part(event, 0, 2000), 2, 2.0);
  const auto other = Noisy(Part(event, 734, 2600), 3, 2.0);
  ASSERT_TRUE(SoundOffset(one, other).has_value());
  EXPECT_NEAR(*SoundOffset(one, other), 7.34, 0.01);
  EXPECT_NEAR(*SoundOffset(other, one), -7.34, 0.01);
  EXPECT_NEAR(*SoundOffset(one, one), 0.0, 0.005);
}

TEST(SoundOffsetTest, IgnoresLoudnessAndSlowChanges) {
  const std::vector<float> event = Talk(1, 2000);
  std::vector<float> other = Part(event, 300, 2000);
  for (size_t i = 0; i < other.size(); ++i) {
    other[i] = 0.5f * other[i] - 2.0f + 0.001f * static_cast<float>(i);
  }
  ASSERT_TRUE(SoundOffset(event, other).has_value());
  EXPECT_NEAR(*SoundOffset(event, other), 3.0, 0.02);
}

TEST(SoundOffsetTest, UnrelatedSoundsHaveNoOffset) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    EXPECT_FALSE(SoundOffset(Talk(seed, 1500), Talk(seed + 100, 1200)).has_value()) << seed;
  }
  EXPECT_FALSE(SoundOffset(std::vector<float>(800, -8.0f), std::vector<float>(800, -8.0f)));
  EXPECT_FALSE(SoundOffset({}, Talk(1, 500)));
  EXPECT_FALSE(SoundOffset(Talk(1, 100), Talk(1, 100))) << "a second tells too little";
}

// A beat matches itself one beat later, too.
TEST(SoundOffsetTest, PeriodicSoundHasNoOffset) {
  std::vector<float> beat(2000, -6.0f);
  for (size_t i = 0; i < beat.size(); i += 50) beat[i] = beat[i + 1] = beat[i + 2] = -2.0f;
  EXPECT_FALSE(SoundOffset(beat, Part(beat, 130, 1800)).has_value());
}

TEST(SoundLevelsTest, MatchesFilm) {
  const ScratchFolder folder;
  ThreadPool pool(1);
  Mp4Writer writer(folder.path() / "silent.mp4",
                   {.width = 64, .height = 48, .frames_per_second = 10});
  for (int i = 0; i < 30; ++i) writer.Add(Image(64, 48, 3, 0.5f), pool);
  writer.Finish();
  GivenSound sound;
  sound.seconds = 3.0;
  sound.level = [](double t) {
    return (t > 1.0 && t < 2.0 ? 0.5 : 0.0) * std::sin(2.0 * M_PI * 440.0 * t);
  };
  for (const char* encoder : {"aac", "pcm_s16le"}) {
    sound.encoder = encoder;
    const auto film = folder.path() / (sound.encoder == "aac" ? "film.mp4" : "film.mov");
    AddSound(folder.path() / "silent.mp4", sound, film);
    const double first_s = FilmReader(film).facts().first_s;
    const auto levels = SoundLevels({film, first_s, first_s + 3.0}, CancellationToken());
    ASSERT_EQ(levels.size(), 300u);
    EXPECT_LT(levels[50], -5.0f) << encoder;
    EXPECT_NEAR(levels[150], std::log10(0.125), 0.1) << encoder;
    EXPECT_LT(levels[250], -5.0f) << encoder;
    EXPECT_NEAR(SoundLevels({film, first_s + 1.2, first_s + 1.5}, CancellationToken())[10],
                std::log10(0.125),
                0.1);
  }
  EXPECT_TRUE(SoundLevels({folder.path() / "silent.mp4", 0.0, 3.0}, CancellationToken()).empty());
  EXPECT_TRUE(SoundLevels({folder.path() / "none.mp4", 0.0, 3.0}, CancellationToken()).empty());
  CancellationToken cancel;
  cancel.Cancel();
  EXPECT_THROW(SoundLevels({folder.path() / "film.mp4", 0.0, 3.0}, cancel), Error);
}

}  // namespace
}  // namespace color3d
