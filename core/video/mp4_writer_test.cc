#include "core/video/mp4_writer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/video/yuv.h"
#include "tests/support/formats/movie_reader.h"

namespace color3d {
namespace {

// Soft stripes of full colours that move by a few pixels per frame.
Image Stripes(int width, int height, int frame) {
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = (x + 3.0 * frame) / width, v = static_cast<double>(y) / height;
      image.At(0, y, x) = static_cast<float>(0.5 + 0.5 * std::sin(6.0 * u));
      image.At(1, y, x) = static_cast<float>(0.5 + 0.5 * std::sin(9.0 * v + 1.0));
      image.At(2, y, x) = static_cast<float>(0.5 + 0.5 * std::cos(7.0 * (u - v)));
    }
  }
  return image;
}

double MeanAbsolute(const Image& a, const Image& b, int channel) {
  double sum = 0.0;
  for (size_t i = 0; i < a.PlaneSize(); ++i) {
    sum += std::abs(a.Plane(channel)[i] - b.Plane(channel)[i]);
  }
  return sum / static_cast<double>(a.PlaneSize());
}

class Mp4WriterTest : public testing::Test {
 protected:
  ScratchFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "movie.mp4";
  ThreadPool pool_{2};
};

TEST_F(Mp4WriterTest, DecodesToWrittenPictures) {
  constexpr int kWidth = 178, kHeight = 102, kFrames = 50;  // no multiples of 16
  Mp4Writer writer(file_, {.width = kWidth, .height = kHeight, .frames_per_second = 25});
  for (int i = 0; i < kFrames; ++i) writer.Add(Stripes(kWidth, kHeight, i), pool_);
  EXPECT_FALSE(std::filesystem::exists(file_)) << "before it is whole";
  writer.Finish();
  const ReadMovie movie = DecodeMovie(file_);
  EXPECT_EQ(movie.codec, writer.encoder() == "mpeg4" ? "mpeg4" : "h264");
  EXPECT_EQ(movie.pixel_format, "yuv420p");
  EXPECT_EQ(movie.width, kWidth);
  EXPECT_EQ(movie.height, kHeight);
  EXPECT_NEAR(movie.frames_per_second, 25.0, 1e-9);
  EXPECT_NEAR(movie.seconds, kFrames / 25.0, 0.041);
  EXPECT_TRUE(movie.index_first);
  EXPECT_TRUE(movie.tagged_bt709);
  ASSERT_EQ(movie.frames.size(), static_cast<size_t>(kFrames));
  for (int i = 0; i < kFrames; ++i) {
    EXPECT_NEAR(movie.times[i], i / 25.0, 1e-4);
    for (int c = 0; c < 3; ++c) {
      EXPECT_LT(MeanAbsolute(movie.frames[i], Stripes(kWidth, kHeight, i), c), 0.012)
          << "frame " << i << " channel " << c;
    }
  }
  EXPECT_EQ(ListFiles(folder_.path()).size(), 1u) << "nothing else is left";
}

TEST_F(Mp4WriterTest, PlainColorsRoundTripWithinTwoOf255) {
  const float colors[][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {0, 0, 0}, {.5, .2, .7}};
  for (const auto& color : colors) {
    Image plain(64, 48, 3);
    for (int c = 0; c < 3; ++c) {
      std::fill_n(plain.Plane(c), plain.PlaneSize(), color[c]);
    }
    Mp4Writer writer(file_, {.width = 64, .height = 48, .frames_per_second = 29.97});
    writer.Add(plain, pool_);
    writer.Finish();
    const ReadMovie movie = DecodeMovie(file_);
    ASSERT_EQ(movie.frames.size(), 1u);
    EXPECT_NEAR(movie.frames_per_second, 29.97, 1e-3);
    for (int c = 0; c < 3; ++c) {
      EXPECT_LT(MeanAbsolute(movie.frames[0], plain, c), 2.01 / 255.0)
          << color[0] << color[1] << color[2];
    }
  }
}

TEST_F(Mp4WriterTest, EqualPicturesGiveEqualBytes) {
  std::string bytes[2];
  for (std::string& movie : bytes) {
    Mp4Writer writer(file_, {.width = 64, .height = 48});
    for (int i = 0; i < 20; ++i) writer.Add(Stripes(64, 48, i), pool_);
    writer.Finish();
    movie = ReadFile(file_);
  }
  EXPECT_TRUE(bytes[0] == bytes[1]);
}

TEST_F(Mp4WriterTest, UnfinishedMovieLeavesNoFile) {
  {
    Mp4Writer writer(file_, {.width = 64, .height = 48});
    writer.Add(Stripes(64, 48, 0), pool_);
  }
  EXPECT_TRUE(ListFiles(folder_.path()).empty());
  Mp4Writer empty(file_, {.width = 64, .height = 48});
  EXPECT_THROW(empty.Finish(), Error);
}

TEST_F(Mp4WriterTest, RejectsInvalidMovies) {
  for (const Mp4Options& options :
       {Mp4Options{.width = 65, .height = 48},
        Mp4Options{.width = 64, .height = 47},
        Mp4Options{.width = 1, .height = 1},
        Mp4Options{.width = 0, .height = 48},
        Mp4Options{.width = 64, .height = 100'000},
        Mp4Options{.width = 64, .height = 48, .frames_per_second = 0}}) {
    EXPECT_THROW(Mp4Writer(file_, options), Error) << options.width << " x " << options.height;
  }
  EXPECT_THROW(Mp4Writer(file_, {.width = 64, .height = 48, .frames_per_second = NAN}), Error);
  EXPECT_THROW(Mp4Writer(folder_.path() / "no/such/folder.mp4", {.width = 64, .height = 48}),
               Error);
  Mp4Writer writer(file_, {.width = 64, .height = 48});
  EXPECT_THROW(writer.Add(Image(48, 64, 3), pool_), Error);
  EXPECT_THROW(writer.Add(Image(64, 48, 1), pool_), Error);
}

TEST_F(Mp4WriterTest, ReportsFullDisk) {
  const std::filesystem::path full = "/dev/full";
  if (!std::filesystem::exists(full)) GTEST_SKIP() << "skipped, because there is no /dev/full";
  std::filesystem::create_symlink(full, file_.string() + ".part");
  try {
    Mp4Writer writer(file_, {.width = 256, .height = 256});
    Image noise(256, 256, 3);
    for (int i = 0; i < 200; ++i) {
      for (size_t k = 0; k < noise.data.size(); ++k) {
        noise.data[k] = static_cast<float>((k * 2654435761u + i * 40503u) % 997) / 997.0f;
      }
      writer.Add(noise, pool_);
    }
    writer.Finish();
    FAIL() << "there was no room";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kResourceExhausted) << e.what();
  }
}

TEST(YuvTest, MapsBlackWhiteAndNaN) {
  ThreadPool pool(1);
  uint8_t y[16] = {}, cb[4] = {}, cr[4] = {};
  for (const float value : {0.0f, 1.0f, 7.0f, NAN}) {
    YuvFromSrgb(Image(4, 4, 3, value), {y, 4}, {cb, 2}, {cr, 2}, pool);
    EXPECT_EQ(y[5], value >= 1.0f ? 235 : 16);
    EXPECT_EQ(cb[3], 128);
    EXPECT_EQ(cr[0], 128);
  }
}

}  // namespace
}  // namespace color3d
