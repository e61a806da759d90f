#include "client/lib/photos/film_as_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/video/mp4_writer.h"

namespace color3d::client {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int kWidth = 64, kHeight = 48;

class FilmAsFramesTest : public testing::Test {
 protected:
  fs::path Write(int frames, bool has_color) {
    const fs::path file = folder_.path() / "film.mp4";
    ThreadPool pool(1);
    Mp4Writer writer(file, {.width = kWidth, .height = kHeight, .frames_per_second = 12});
    for (int i = 0; i < frames; ++i) {
      Image image(kWidth, kHeight, 3);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const float level = 0.3f + 0.3f * static_cast<float>(x) / kWidth;
          for (int c = 0; c < 3; ++c) {
            const bool is_lit = has_color && c == (y < kHeight / 2 ? 0 : 2);
            image.At(c, y, x) = is_lit ? level + 0.3f : level;
          }
        }
      }
      writer.Add(image, pool);
    }
    writer.Finish();
    return file;
  }
  FilmAsFrames Take(std::optional<double> end_s = std::nullopt) {
    return DecodeFilmFrames(CollectPhotos(folder_.path() / "film.mp4"),
                            end_s,
                            scratch_.path(),
                            CancellationToken(),
                            [](int, int) {});
  }
  std::string Complaint(std::optional<double> end_s = std::nullopt) {
    try {
      Take(end_s);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }

  ScratchFolder folder_, scratch_;
};

TEST_F(FilmAsFramesTest, WritesFramesInColor) {
  Write(10, true);
  const FilmAsFrames film = Take();
  EXPECT_NEAR(film.frames_per_second, 12.0, 1e-6);
  EXPECT_FALSE(film.folder.film);
  EXPECT_EQ(film.folder.Name(), "film.mp4");
  ASSERT_EQ(film.folder.photos.size(), 10u);
  EXPECT_EQ(film.folder.photos[7].path, "frames/f000007.png");
  const Image frame = ReadImage(film.folder.photos[7].file);
  EXPECT_EQ(frame.width, kWidth);
  EXPECT_GT(frame.At(0, 10, 30), frame.At(2, 10, 30) + 0.2f);
  EXPECT_EQ(Take(0.5).folder.photos.size(), 6u);
}

TEST_F(FilmAsFramesTest, RefusesFilmsThatCannotBeScored) {
  Write(10, false);
  EXPECT_THAT(Complaint(), HasSubstr("film.mp4 is monochrome (5 of 5 frames inspected)"));
  Write(10, true);
  EXPECT_THAT(Complaint(0.1), HasSubstr("has 2 frames before 0.1 s (film_end_s)"));
  EXPECT_TRUE(fs::is_empty(scratch_.path()));
}

}  // namespace
}  // namespace color3d::client
