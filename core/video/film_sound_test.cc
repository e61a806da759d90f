#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/video/film_reader.h"
#include "core/video/mp4_writer.h"
#include "tests/support/formats/movie_reader.h"
#include "tests/support/formats/sound_film.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr double kBeepS = 0.1;

// A beep at every second, from a low one upwards.
double Beeps(double time_s) {
  const double second = std::floor(time_s);
  if (time_s < 0.0 || time_s - second >= kBeepS) return 0.0;
  return 0.6 * std::sin(2.0 * M_PI * (400.0 + 200.0 * second) * time_s);
}

// Times at which sound follows silence, s.
std::vector<double> Onsets(const HeardSound& sound) {
  const int window = sound.sample_rate / 200;
  std::vector<double> onsets;
  int silent = window * 10;
  for (int i = 0; i < static_cast<int>(sound.samples.size()); ++i) {
    const bool loud = std::abs(sound.samples[i]) > 0.15f;
    if (loud && silent >= window * 10) {
      onsets.push_back(static_cast<double>(i) / sound.sample_rate);
    }
    silent = loud ? 0 : silent + 1;
  }
  return onsets;
}

// Frequency after a time, Hz.
double PitchAt(const HeardSound& sound, double time_s) {
  const int begin = static_cast<int>((time_s + 0.02) * sound.sample_rate);
  const int end = static_cast<int>((time_s + 0.08) * sound.sample_rate);
  int crossings = 0;
  for (int i = begin + 1; i < end; ++i) {
    crossings += sound.samples.at(i - 1) < 0.0f && sound.samples.at(i) >= 0.0f ? 1 : 0;
  }
  return crossings / 0.06;
}

class FilmSoundTest : public testing::Test {
 protected:
  // `seconds` of grey at 10 frames a second.
  fs::path Silent(double seconds) {
    const fs::path file = folder_.path() / "silent.mp4";
    Mp4Writer writer(file, {.width = 64, .height = 48, .frames_per_second = 10});
    for (int i = 0; i < std::lround(10 * seconds); ++i) {
      writer.Add(Image(64, 48, 3, 0.4f + 0.01f * static_cast<float>(i % 10)), pool_);
    }
    writer.Finish();
    return file;
  }
  fs::path WithSound(const GivenSound& sound, const char* ending, double film_s = 5.0) {
    const fs::path file = folder_.path() / (std::string("film") + ending);
    AddSound(Silent(film_s), sound, file);
    return file;
  }
  // The part of the film from one time of its pictures to another, frames `stride` apart.
  HeardSound PartOf(const fs::path& film, double begin_s, double end_s) {
    FilmReader reader(film);
    EXPECT_TRUE(reader.facts().has_sound);
    const fs::path file = folder_.path() / "part.mp4";
    const double first_s = reader.facts().first_s;
    Mp4Writer writer(file,
                     {.width = 64,
                      .height = 48,
                      .frames_per_second = 10,
                      .sound = SoundPart{film, first_s + begin_s, first_s + end_s}});
    for (int i = 0; i < std::lround(10 * (end_s - begin_s)); ++i) {
      writer.Add(Image(64, 48, 3, 0.5f), pool_);
    }
    writer.Finish();
    warning_ = writer.sound_warning();
    return HearFilm(file);
  }

  ScratchFolder folder_;
  ThreadPool pool_{1};
  std::string warning_;
};

// Onsets of 1, 2, 3, ... s of the film, in the part's time.
void ExpectBeeps(const HeardSound& sound, double begin_s, double end_s, double tolerance_s) {
  std::vector<double> expected;
  for (double at = std::ceil(begin_s); at < end_s; at += 1.0) expected.push_back(at);
  const std::vector<double> onsets = Onsets(sound);
  ASSERT_EQ(onsets.size(), expected.size());
  for (size_t i = 0; i < onsets.size(); ++i) {
    EXPECT_NEAR(onsets[i], expected[i] - begin_s, tolerance_s) << i;
    EXPECT_NEAR(PitchAt(sound, onsets[i]), 400.0 + 200.0 * expected[i], 25.0) << i;
  }
}

TEST_F(FilmSoundTest, CopiesSoundUnchanged) {
  const std::pair<const char*, const char*> kinds[] = {
      {"aac", ".mp4"}, {"ac3", ".mp4"}, {"aac", ".mkv"}, {"aac", ".mov"}, {"ac3", ".mts"}};
  for (const auto& [codec, ending] : kinds) {
    SCOPED_TRACE(std::string(codec) + ending);
    const fs::path film = WithSound({.encoder = codec, .seconds = 5.0, .level = Beeps}, ending);
    const HeardSound whole = PartOf(film, 0.0, 5.0);
    EXPECT_EQ(warning_, "");
    EXPECT_EQ(whole.codec, codec);
    EXPECT_EQ(whole.sample_rate, 48000);
    EXPECT_EQ(whole.channels, 2);
    EXPECT_NEAR(static_cast<double>(whole.samples.size()) / 48000, 5.0, 0.07);
    ExpectBeeps(whole, 0.0, 5.0, 0.008);
    const HeardSound part = PartOf(film, 1.6, 4.2);
    EXPECT_EQ(part.codec, codec);
    EXPECT_NEAR(static_cast<double>(part.samples.size()) / 48000, 2.6, 0.07);
    ExpectBeeps(part, 1.6, 4.2, 0.008);
  }
}

TEST_F(FilmSoundTest, ReencodesSoundUnsupportedByMp4) {
  const std::pair<const char*, const char*> kinds[] = {
      {"pcm_s16le", ".mov"}, {"flac", ".mkv"}, {"mp2", ".mkv"}, {"pcm_s32le", ".mkv"}};
  for (const auto& [codec, ending] : kinds) {
    SCOPED_TRACE(std::string(codec) + ending);
    const fs::path film = WithSound(
        {.encoder = codec, .sample_rate = 44100, .channels = 1, .seconds = 5.0, .level = Beeps},
        ending);
    const HeardSound part = PartOf(film, 1.6, 4.2);
    EXPECT_EQ(warning_, "");
    EXPECT_EQ(part.codec, "aac");
    EXPECT_EQ(part.sample_rate, 44100);
    EXPECT_EQ(part.channels, 1);
    EXPECT_NEAR(static_cast<double>(part.samples.size()) / 44100, 2.6, 0.05);
    ExpectBeeps(part, 1.6, 4.2, 0.008);
  }
}

TEST_F(FilmSoundTest, KeepsOffsetAndEndOfSound) {
  for (const char* codec : {"aac", "pcm_s16le"}) {
    SCOPED_TRACE(codec);
    const fs::path film =
        WithSound({.encoder = codec, .begin_s = 1.5, .seconds = 2.0, .level = Beeps}, ".mov");
    ExpectBeeps(PartOf(film, 0.0, 5.0), 1.5, 3.5, 3.0);  // as many
    const std::vector<double> onsets = Onsets(PartOf(film, 0.0, 5.0));
    EXPECT_NEAR(onsets[0], 2.0, 0.008);
    EXPECT_NEAR(onsets[1], 3.0, 0.008);
    EXPECT_TRUE(PartOf(film, 4.0, 5.0).samples.size() < 48000 / 10);
  }
}

TEST_F(FilmSoundTest, LeadingSilenceTakesNoMemory) {
  const fs::path film = WithSound(
      {.encoder = "pcm_s16le", .begin_s = 30.0, .seconds = 1.0, .level = Beeps}, ".mov", 32.0);
  const std::vector<double> onsets = Onsets(PartOf(film, 0.0, 32.0));
  ASSERT_EQ(onsets.size(), 1u);
  EXPECT_NEAR(onsets[0], 30.0, 0.008);
}

TEST_F(FilmSoundTest, NamesUnreadableSound) {
  // A rate that AAC does not support.
  const fs::path film = WithSound(
      {.encoder = "pcm_s16le", .sample_rate = 37000, .seconds = 2.0, .level = Beeps}, ".mov");
  EXPECT_EQ(PartOf(film, 0.0, 2.0).codec, "");
  EXPECT_THAT(warning_, HasSubstr("pcm_s16le"));
  EXPECT_THAT(warning_, HasSubstr("left out"));
}

TEST_F(FilmSoundTest, WritesNoStreamWithoutSound) {
  const fs::path file = folder_.path() / "still.mp4";
  const fs::path film = Silent(1.0);
  EXPECT_FALSE(FilmReader(film).facts().has_sound);
  Mp4Writer writer(
      file,
      {.width = 64, .height = 48, .frames_per_second = 10, .sound = SoundPart{film, 0.0, 1.0}});
  writer.Add(Image(64, 48, 3, 0.5f), pool_);
  writer.Finish();
  EXPECT_EQ(HearFilm(file).codec, "");
  EXPECT_EQ(writer.sound_warning(), "");
}

TEST_F(FilmSoundTest, KeepsSoundOfRealClips) {
  const fs::path video = fs::path(COLOR3D_SHARED_DATA) / "video";
  const fs::path clips[] = {video / "clips/pi3_skating.mp4",
                            video / "athlete4cam/videos/cam02.mp4"};
  if (!fs::exists(clips[0])) GTEST_SKIP() << "no clips";
  for (const fs::path& clip : clips) {
    SCOPED_TRACE(clip.filename().string());
    const FilmFacts facts = FilmReader(clip).facts();
    const HeardSound whole = HearFilm(clip);
    const double begin_s = 0.4 * facts.seconds, end_s = 0.9 * facts.seconds;
    const HeardSound part = PartOf(clip, begin_s, end_s);
    std::printf("%s: %s, %d Hz, %.2f s of sound, %.2f s of pictures; part %.2f s\n",
                clip.filename().c_str(),
                whole.codec.c_str(),
                whole.sample_rate,
                static_cast<double>(whole.samples.size()) / whole.sample_rate,
                facts.seconds,
                static_cast<double>(part.samples.size()) / part.sample_rate);
    EXPECT_EQ(part.codec, whole.codec);
    ASSERT_EQ(part.sample_rate, whole.sample_rate);
    const auto is_zero = [](float sample) { return sample == 0.0f; };
    if (std::all_of(whole.samples.begin(), whole.samples.end(), is_zero)) {
      // A silent track is kept.
      EXPECT_TRUE(std::all_of(part.samples.begin(), part.samples.end(), is_zero));
      continue;
    }
    // Every sample at its time.
    const auto shift = static_cast<int>(std::lround((facts.first_s + begin_s) * whole.sample_rate));
    double best = -1.0;
    int at = 0;
    for (int lag = -200; lag <= 200; ++lag) {
      double product = 0.0, one = 1e-12, other = 1e-12;
      for (int i = 4096; i < static_cast<int>(part.samples.size()) - 4096; i += 7) {
        const int k = shift + i + lag;
        if (k < 0 || k >= static_cast<int>(whole.samples.size())) continue;
        product += part.samples[i] * whole.samples[k];
        one += part.samples[i] * part.samples[i];
        other += whole.samples[k] * whole.samples[k];
      }
      const double correlation = product / std::sqrt(one * other);
      if (correlation > best) {
        best = correlation;
        at = lag;
      }
    }
    EXPECT_GT(best, 0.98);
    EXPECT_LE(std::abs(at), whole.sample_rate / 500) << "2 ms";
  }
}

TEST_F(FilmSoundTest, AcceptsUnevenFrameTimes) {
  const std::vector<double> times = {0.0, 0.1, 0.15, 0.4, 1.0, 1.0 + 1 / 24.0};
  const fs::path file = folder_.path() / "uneven.mp4";
  Mp4Writer writer(file,
                   {.width = 64, .height = 48, .frames_per_second = 10, .ticks_per_second = 24000});
  for (size_t i = 0; i < times.size(); ++i) {
    writer.AddAt(times[i], 0.5, Image(64, 48, 3, 0.3f + 0.1f * static_cast<float>(i)), pool_);
  }
  const auto refused = [&](double time_s, double seconds) {
    EXPECT_THROW(writer.AddAt(time_s, seconds, Image(64, 48, 3, 0.5f), pool_), Error);
  };
  refused(times.back(), 0.1);
  refused(0.5, 0.1);
  refused(std::nan(""), 0.1);
  refused(5.0, 0.0);
  EXPECT_THROW(writer.Add(Image(64, 48, 3, 0.5f), pool_), Error);
  writer.Finish();
  FilmReader film(file);
  ASSERT_EQ(film.times().size(), times.size());
  for (size_t i = 0; i < times.size(); ++i) {
    EXPECT_NEAR(film.times()[i], times[i], 1e-6);
    EXPECT_NEAR(
        film.Read(static_cast<int>(i)).At(1, 20, 30), 0.3 + 0.1 * static_cast<double>(i), 0.03);
  }
  EXPECT_FALSE(film.facts().constant_rate);
  EXPECT_NEAR(DecodeMovie(file).seconds, times.back() + 0.5, 0.01);
}

}  // namespace
}  // namespace color3d
