// Films of every codec and container: all frames are read, and damaged ones are not returned.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/video/film_reader.h"
#include "tests/support/formats/numbered_film.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

class FilmContainersTest : public testing::Test {
 protected:
  ScratchFolder folder_;
};

// Reads in order, twice (as the exposure correction does); from the middle; by strides longer than
// a group; and backwards.
void ExpectEveryFrame(const fs::path& file, int frames) {
  FilmReader film(file);
  ASSERT_EQ(film.times().size(), static_cast<size_t>(frames));
  EXPECT_TRUE(film.facts().constant_rate);
  for (int i = 0; i < frames; ++i) ASSERT_EQ(NumberOf(film.Read(i)), i);
  for (int i = 3; i < frames; ++i) ASSERT_EQ(NumberOf(film.Read(i)), i);
  FilmReader middle(file);
  for (int i = frames / 2 + 1; i < frames; ++i) ASSERT_EQ(NumberOf(middle.Read(i)), i);
  FilmReader strides(file);
  for (int i = 1; i < frames; i += 17) ASSERT_EQ(NumberOf(strides.Read(i)), i);
  for (int i = frames - 1; i >= 0; i -= 5) ASSERT_EQ(NumberOf(strides.Read(i)), i);
}

TEST_F(FilmContainersTest, FindsEveryFrameOfEveryContainer) {
  const struct {
    const char* encoder;
    const char* name;
    int b_frames;
    bool is_flat;
  } kinds[] = {{"libx264", "film.mts", 2, false},
               {"libx264", "film.avi", 3, false},  // some of which are reference pictures
               {"libx264", "film.vob", 2, true},
               {"libx264", "film.mkv", 2, false},
               {"libx264", "film.flv", 2, false},
               {"mpeg2video", "film.mts", 2, false},
               {"mpeg2video", "film.m2ts", 0, false},
               {"mpeg2video", "film.mpg", 2, false},
               {"mpeg2video", "film.vob", 2, true},
               {"mpeg2video", "film.mkv", 2, false},
               {"mpeg2video", "film.mxf", 2, false},
               {"mpeg1video", "film.mpg", 2, false},
               {"mpeg1video", "film.mpg", 2, true},
               {"mpeg4", "film.avi", 2, false},
               {"mpeg4", "film.avi", 0, false},
               {"mpeg4", "film.3gp", 2, false},
               {"wmv2", "film.wmv", 0, false}};
  for (const auto& kind : kinds) {
    SCOPED_TRACE(std::string(kind.encoder) + " in " + kind.name);
    const fs::path file = folder_.path() / kind.name;
    const NumberedFilm film = {
        .encoder = kind.encoder, .frames = 52, .b_frames = kind.b_frames, .is_flat = kind.is_flat};
    const bool is_written = WriteNumberedFilm(file, film);
    EXPECT_TRUE(is_written || film.encoder == "libx264") << "the others are FFmpeg's own";
    if (is_written) ExpectEveryFrame(file, film.frames);
  }
}

TEST_F(FilmContainersTest, SplitsTwoPicturesOfOnePacket) {
  const fs::path file = folder_.path() / "film.avi";
  WriteNumberedFilm(file, {.encoder = "mpeg4", .frames = 50, .b_frames = 1, .is_packed = true});
  ExpectEveryFrame(file, 50);
}

TEST_F(FilmContainersTest, JoinsSeparatelyCodedFields) {
  for (const bool one_packet : {true, false}) {
    SCOPED_TRACE(one_packet);
    const fs::path file = folder_.path() / "fields.mts";
    WriteFieldFilm(file, 40, one_packet);
    ExpectEveryFrame(file, 40);
    EXPECT_TRUE(FilmReader(file).facts().interlaced);
  }
}

TEST_F(FilmContainersTest, ReadsConcatenatedRecordings) {
  for (const char* name : {"film.mts", "film.mpg"}) {
    SCOPED_TRACE(name);
    const fs::path file = folder_.path() / name;
    WriteNumberedFilm(file, {.encoder = "mpeg2video", .frames = 40});
    const std::string one = ReadFile(file);
    WriteFileAtomic(file, one + one);
    FilmReader film(file);
    ASSERT_EQ(film.times().size(), 80u);
    EXPECT_TRUE(film.facts().constant_rate);
    for (const int i : {0, 30, 41, 79, 50, 12}) EXPECT_EQ(NumberOf(film.Read(i)), i % 40);
  }
}

TEST_F(FilmContainersTest, RecordingMayBeginInsideGroup) {
  constexpr int kPacket = 188;
  const fs::path file = folder_.path() / "film.mts";
  WriteNumberedFilm(file, {.encoder = "mpeg2video", .frames = 50});
  const size_t begin = PacketsOf(file).at(5).pos / kPacket * kPacket;
  WriteFileAtomic(file, ReadFile(file).substr(begin));
  FilmReader film(file);
  const int frames = static_cast<int>(film.times().size());
  EXPECT_GT(frames, 40);
  EXPECT_THROW(film.Read(0), Error);
  for (int i = 10; i < frames; ++i) EXPECT_EQ(NumberOf(film.Read(i)), 50 - frames + i);
}

double DifferingShare(const Image& x, const Image& y) {
  size_t differ = 0;
  for (size_t i = 0; i < x.PlaneSize(); ++i)
    differ += std::abs(x.Plane(1)[i] - y.Plane(1)[i]) > 0.08f;
  return static_cast<double>(differ) / static_cast<double>(x.PlaneSize());
}

// A frame in the middle of a group is damaged. Returned frames are unchanged.
TEST_F(FilmContainersTest, FramesPredictedFromDamagedOneAreDamaged) {
  constexpr int kFrames = 60, kDamaged = 16;  // key frames at 0, 12, 24, ... or one or two later
  const struct {
    const char* encoder;
    const char* ending;
    int b_frames;
    int begin, end;  // damaged bytes, after the headers of the picture and its container
  } kinds[] = {{"libx264", ".mp4", 0, 40, 2000},
               {"libx264", ".mkv", 2, 40, 2000},
               {"mpeg2video", ".mts", 2, 380, 560},
               {"mpeg2video", ".mpg", 2, 380, 560},
               {"mpeg4", ".avi", 0, 380, 560},
               {"mpeg4", ".avi", 2, 380, 560}};
  for (const auto& kind : kinds) {
    SCOPED_TRACE(std::string(kind.encoder) + kind.ending);
    const fs::path file = folder_.path() / (std::string("whole") + kind.ending);
    const NumberedFilm numbered = {
        .encoder = kind.encoder, .frames = kFrames, .b_frames = kind.b_frames};
    const bool is_written = WriteNumberedFilm(file, numbered);
    EXPECT_TRUE(is_written || numbered.encoder == "libx264") << "the others are FFmpeg's own";
    if (!is_written) continue;
    std::string bytes = ReadFile(file);
    const PacketPlace place = PacketsOf(file).at(kDamaged);
    const fs::path broken = folder_.path() / (std::string("broken") + kind.ending);
    for (int i = kind.begin; i < std::min(place.size, kind.end); ++i) {
      bytes[place.pos + i] = static_cast<char>(0x5a ^ (i * 37));
    }
    WriteFileAtomic(broken, bytes);
    FilmReader whole(file), film(broken);
    ASSERT_EQ(film.times().size(), static_cast<size_t>(kFrames));
    std::vector<bool> is_whole;
    for (int i = 0; i < kFrames; ++i) {
      try {
        EXPECT_LT(DifferingShare(film.Read(i), whole.Read(i)), 0.01) << "frame " << i;
        is_whole.push_back(true);
      } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::kDataLoss);
        is_whole.push_back(false);
      }
    }
    const auto refused = std::count(is_whole.begin(), is_whole.end(), false);
    EXPECT_GE(refused, 4);
    EXPECT_LE(refused, 14);
    for (int i = 0; i < kFrames; ++i) {
      const bool is_near = i >= 12 && i < 27;
      EXPECT_TRUE(is_whole[i] || is_near) << i;
    }
    // Independent of the order of reading.
    FilmReader back(broken);
    for (int i = kFrames - 1; i >= 0; --i) {
      try {
        const Image image = back.Read(i);
        EXPECT_TRUE(is_whole[i]) << i;
      } catch (const Error&) {
        EXPECT_FALSE(is_whole[i]) << i;
      }
    }
  }
}

}  // namespace
}  // namespace color3d
