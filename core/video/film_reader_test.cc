#include "core/video/film_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/video/mp4_writer.h"
#include "tests/support/formats/interlaced_film.h"
#include "tests/support/formats/movie_reader.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int kWidth = 96, kHeight = 64;

// Grows brighter by a fixed step; its left half is darker, its upper half redder.
Image Step(int frame, int frames) {
  Image image(kWidth, kHeight, 3);
  const float level = 0.2f + 0.6f * static_cast<float>(frame) / static_cast<float>(frames);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const float side = x < kWidth / 2 ? 0.7f : 1.0f;
      image.At(0, y, x) = side * level * (y < kHeight / 2 ? 1.2f : 1.0f);
      image.At(1, y, x) = side * level;
      image.At(2, y, x) = side * level;
    }
  }
  return image;
}

float MeanGreen(const Image& image, int x0, int x1, int y0, int y1) {
  double sum = 0.0;
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) sum += image.At(1, y, x);
  }
  return static_cast<float>(sum / ((x1 - x0) * (y1 - y0)));
}

class FilmReaderTest : public testing::Test {
 protected:
  fs::path Film(int frames, double frames_per_second = 25.0) {
    const fs::path file = folder_.path() / "film.mp4";
    Mp4Writer writer(file,
                     {.width = kWidth, .height = kHeight, .frames_per_second = frames_per_second});
    for (int i = 0; i < frames; ++i) writer.Add(Step(i, frames), pool_);
    writer.Finish();
    return file;
  }

  std::string Complaint(const fs::path& file) {
    try {
      FilmReader reader(file);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }

  ScratchFolder folder_;
  ThreadPool pool_{1};
};

TEST_F(FilmReaderTest, ReadsFramesInAnyOrder) {
  constexpr int kFrames = 130;  // more than two groups of pictures
  FilmReader film(Film(kFrames));
  EXPECT_EQ(film.facts().width, kWidth);
  EXPECT_EQ(film.facts().height, kHeight);
  EXPECT_EQ(film.facts().quarter_turns, 0);
  EXPECT_TRUE(film.facts().constant_rate);
  EXPECT_FALSE(film.facts().interlaced);
  EXPECT_NEAR(film.facts().seconds, kFrames / 25.0, 0.05);
  ASSERT_EQ(film.times().size(), static_cast<size_t>(kFrames));
  EXPECT_NEAR(film.times()[50], 2.0, 1e-6);
  const ReadMovie whole = DecodeMovie(folder_.path() / "film.mp4");
  for (const int frame : {0, 1, 2, 60, 61, 59, 129, 3, 3, 128, 0}) {
    const Image image = film.Read(frame);
    const Image& expected = whole.frames.at(frame);
    ASSERT_EQ(image.data.size(), expected.data.size());
    double worst = 0.0;
    for (size_t i = 0; i < image.data.size(); ++i) {
      worst = std::max<double>(worst, std::abs(image.data[i] - expected.data[i]));
    }
    EXPECT_LT(worst, 0.02) << "frame " << frame;
  }
  EXPECT_THROW(film.Read(130), Error);
  EXPECT_THROW(film.Read(-1), Error);
}

// A bar moves to the right; the odd lines of each frame show it half a frame later than the even
// ones.
double BarAt(double frame) { return 10.0 + 6.0 * frame; }

double MiddleOfBar(const Image& image, int y) {
  double sum = 0.0, weighted = 0.0;
  for (int x = 0; x < image.width; ++x) {
    const double light = std::max(0.0f, image.At(1, y, x) - 0.3f);
    sum += light;
    weighted += x * light;
  }
  return weighted / sum;
}

TEST_F(FilmReaderTest, TakesOneFieldOfInterlacedFrames) {
  constexpr int kFrames = 10;
  for (const char* name : {"fields.mov", "fields.mts", "fields.mpg"}) {
    SCOPED_TRACE(name);
    const fs::path file = folder_.path() / name;
    WriteInterlacedFilm(file, kWidth, kHeight, kFrames, [](int frame, int field, int x) {
      return std::abs(x - BarAt(frame + 0.5 * field)) < 8.0 ? 0.9 : 0.02;
    });
    FilmReader film(file);
    EXPECT_TRUE(film.facts().interlaced);
    ASSERT_EQ(film.times().size(), static_cast<size_t>(kFrames));
    EXPECT_EQ(film.facts().height, kHeight);
    for (const int frame : {0, 4, 9, 3}) {
      const Image image = film.Read(frame);
      ASSERT_EQ(image.height, kHeight);
      for (int y = 4; y < kHeight - 4; ++y) {
        EXPECT_NEAR(MiddleOfBar(image, y), BarAt(frame), 1.0) << "frame " << frame << " line " << y;
      }
    }
  }
}

TEST_F(FilmReaderTest, AcceptsOneFrame) {
  FilmReader film(Film(1));
  EXPECT_EQ(film.times(), std::vector<double>{0.0});
  EXPECT_NEAR(MeanGreen(film.Read(0), 56, 88, 8, 56), 0.2, 0.02);
}

// The matrix of the track's header (ISO 14496-12, 8.3.2): a, b, u, c, d, v, x, y, w.
void Turn(const fs::path& file, int quarter_turns) {
  std::string bytes = ReadFile(file);
  const size_t header = bytes.find("tkhd");
  ASSERT_NE(header, std::string::npos);
  const size_t matrix = header + 4 + 4 + 20 + 16;
  const int32_t c[] = {1, 0, -1, 0}, s[] = {0, 1, 0, -1};
  const int32_t values[] = {
      c[quarter_turns], s[quarter_turns], -s[quarter_turns], c[quarter_turns]};
  const size_t places[] = {0, 4, 12, 16};
  for (int i = 0; i < 4; ++i) {
    const uint32_t fixed = static_cast<uint32_t>(values[i] * 65536);
    for (int k = 0; k < 4; ++k) {
      bytes[matrix + places[i] + k] = static_cast<char>(fixed >> (24 - 8 * k));
    }
  }
  WriteFileAtomic(file, bytes);
}

TEST_F(FilmReaderTest, AppliesRotationOfPhone) {
  for (int turns = 1; turns < 4; ++turns) {
    const fs::path file = Film(3);
    Turn(file, turns);
    FilmReader film(file);
    SCOPED_TRACE(turns);
    ASSERT_EQ(film.facts().quarter_turns, turns);
    const bool lies = turns % 2 == 1;
    EXPECT_EQ(film.facts().width, lies ? kHeight : kWidth);
    const Image image = film.Read(1);
    ASSERT_EQ(image.width, film.facts().width);
    ASSERT_EQ(image.height, film.facts().height);
    // The dark left side turns clockwise to the top, the right, the bottom.
    const int w = image.width, h = image.height;
    const float dark = turns == 1   ? MeanGreen(image, 8, w - 8, 4, h / 2 - 4)
                       : turns == 2 ? MeanGreen(image, w / 2 + 4, w - 4, 8, h - 8)
                                    : MeanGreen(image, 8, w - 8, h / 2 + 4, h - 4);
    const float bright = turns == 1   ? MeanGreen(image, 8, w - 8, h / 2 + 4, h - 4)
                         : turns == 2 ? MeanGreen(image, 4, w / 2 - 4, 8, h - 8)
                                      : MeanGreen(image, 8, w - 8, 4, h / 2 - 4);
    EXPECT_NEAR(dark / bright, 0.7, 0.03);
  }
}

uint32_t BigEndian(const std::string& bytes, size_t at) {
  uint32_t value = 0;
  for (int k = 0; k < 4; ++k) value = value << 8 | static_cast<uint8_t>(bytes[at + k]);
  return value;
}

// Trims as phones do: the track's edit list (ISO 14496-12, 8.6.6) begins later, the pictures stay.
void TrimBegin(const fs::path& file, double seconds) {
  std::string bytes = ReadFile(file);
  const size_t media = bytes.find("mdhd"), edits = bytes.find("elst");
  ASSERT_NE(media, std::string::npos);
  ASSERT_NE(edits, std::string::npos);
  ASSERT_EQ(BigEndian(bytes, edits + 8), 1u);  // one edit
  const size_t media_time = edits + 16;
  const uint32_t begin = BigEndian(bytes, media_time) +
                         static_cast<uint32_t>(std::lround(seconds * BigEndian(bytes, media + 16)));
  for (int k = 0; k < 4; ++k) bytes[media_time + k] = static_cast<char>(begin >> (24 - 8 * k));
  WriteFileAtomic(file, bytes);
}

TEST_F(FilmReaderTest, OmitsFramesTrimmedByEditList) {
  constexpr int kFrames = 80, kTrimmed = 30;
  const fs::path file = Film(kFrames);
  TrimBegin(file, kTrimmed / 25.0);
  FilmReader film(file);
  ASSERT_EQ(film.times().size(), static_cast<size_t>(kFrames - kTrimmed));
  EXPECT_NEAR(film.facts().first_s, 0.0, 1e-6);
  EXPECT_NEAR(film.times()[1], 0.04, 1e-6);
  for (const int frame : {0, 1, 25, kFrames - kTrimmed - 1, 3}) {
    const float level = 0.2f + 0.6f * static_cast<float>(kTrimmed + frame) / kFrames;
    EXPECT_NEAR(MeanGreen(film.Read(frame), 56, 88, 8, 56), level, 0.02) << frame;
  }
}

TEST_F(FilmReaderTest, DamageLosesAffectedFramesOnly) {
  constexpr int kFrames = 150;  // key frames every 2 s: 0, 50, 100
  const fs::path file = Film(kFrames);
  std::string bytes = ReadFile(file);
  const size_t data = bytes.find("mdat");
  ASSERT_NE(data, std::string::npos);
  const size_t middle = data + (bytes.size() - data) / 2;
  for (size_t i = middle; i < middle + 300; ++i) bytes[i] = static_cast<char>(0x5a ^ (i * 37));
  WriteFileAtomic(file, bytes);
  FilmReader film(file);
  int whole = 0;
  for (int i = 0; i < kFrames; ++i) {
    try {
      const Image image = film.Read(i);
      ++whole;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kDataLoss);
      EXPECT_THAT(e.what(), HasSubstr("film.mp4"));
    }
  }
  EXPECT_LT(whole, kFrames);
  EXPECT_GE(whole, kFrames / 3);
  EXPECT_NEAR(MeanGreen(film.Read(0), 56, 88, 8, 56), 0.2, 0.02);
  const float last = 0.2f + 0.6f * 149 / 150;
  EXPECT_NEAR(MeanGreen(film.Read(kFrames - 1), 56, 88, 8, 56), last, 0.02);
}

// A second of silence as a WAV file.
std::string Silence() {
  const auto little = [](uint32_t value, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i));
    return text;
  };
  return "RIFF" + little(36 + 8000, 4) + "WAVEfmt " + little(16, 4) + little(1, 2) + little(1, 2) +
         little(8000, 4) + little(8000, 4) + little(1, 2) + little(8, 2) + "data" +
         little(8000, 4) + std::string(8000, '\x80');
}

TEST_F(FilmReaderTest, RejectsOtherFiles) {
  WriteFileAtomic(folder_.path() / "sound.wav", Silence());
  EXPECT_THAT(Complaint(folder_.path() / "sound.wav"), HasSubstr("only sound"));
  WriteFileAtomic(folder_.path() / "text.mp4", "this is no film");
  EXPECT_THAT(Complaint(folder_.path() / "text.mp4"), HasSubstr("text.mp4"));
  WriteFileAtomic(folder_.path() / "empty.mp4", "");
  EXPECT_THAT(Complaint(folder_.path() / "empty.mp4"), HasSubstr("empty.mp4"));
  EXPECT_THAT(Complaint(folder_.path() / "none.mp4"), HasSubstr("there is no film"));
  EXPECT_THAT(Complaint(folder_.path()), HasSubstr("there is no film"));
  // The index at the front, without data after it.
  const fs::path file = Film(30);
  const std::string bytes = ReadFile(file);
  WriteFileAtomic(file, bytes.substr(0, bytes.find("mdat") + 8));
  EXPECT_THROW(FilmReader(file).Read(5), Error);
}

TEST_F(FilmReaderTest, ReadsRealClips) {
  const fs::path clips = fs::path(COLOR3D_SHARED_DATA) / "video/clips";
  if (!fs::exists(clips)) GTEST_SKIP() << "no clips";
  for (const auto& entry : fs::directory_iterator(clips)) {
    if (entry.path().extension() != ".mp4") continue;
    SCOPED_TRACE(entry.path().filename().string());
    FilmReader film(entry.path());
    const int last = static_cast<int>(film.times().size()) - 1;
    const Image image = film.Read(last);
    EXPECT_EQ(image.width, film.facts().width);
    EXPECT_GT(MeanGreen(image, 0, image.width, 0, image.height), 0.02);
    EXPECT_EQ(film.Read(last / 2).height, film.facts().height);
    std::printf("%s: %d frames, %.2f s, %d x %d px, %s\n",
                entry.path().filename().c_str(),
                last + 1,
                film.facts().seconds,
                film.facts().width,
                film.facts().height,
                film.facts().codec.c_str());
  }
}

}  // namespace
}  // namespace color3d
