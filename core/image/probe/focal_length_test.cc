#include "core/image/probe/focal_length.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/image/codec.h"
#include "tests/support/scenes/test_exif.h"

namespace color3d {
namespace {

std::string JpegWith(const std::vector<ExifTag>& tags) {
  return WithExif(EncodeJpeg(Image(8, 6, 1, 0.5f)), tags);
}

TEST(FocalLength, FilmEquivalentKeepsDiagonal) {
  // 28 mm on 36 x 24 mm film.
  EXPECT_NEAR(ReadFocalLengthPx(JpegWith({{41989, 3, 28}}), 3600, 2400), 2800.0, 0.5);
  EXPECT_NEAR(
      ReadFocalLengthPx(JpegWith({{41989, 3, 28}}), 4000, 3000), 28.0 / 43.2666 * 5000.0, 0.5);
}

TEST(FocalLength, UsesSensorResolutionOfReducedCopy) {
  // 35 mm, 1000 px per cm when taken at 3000 px; the copy has 1500.
  const std::string jpeg =
      JpegWith({{37386, 5, 350, 10}, {40962, 4, 3000}, {41486, 5, 1000, 1}, {41488, 3, 3}});
  EXPECT_NEAR(ReadFocalLengthPx(jpeg, 3000, 2000), 3500.0, 1e-6);
  EXPECT_NEAR(ReadFocalLengthPx(jpeg, 1500, 1000), 1750.0, 1e-6);
}

TEST(FocalLength, UnknownAndAbsurdValuesAreZero) {
  EXPECT_EQ(ReadFocalLengthPx("", 100, 100), 0.0);
  EXPECT_EQ(ReadFocalLengthPx(EncodePng8(Image(8, 6, 1)), 8, 6), 0.0);
  EXPECT_EQ(ReadFocalLengthPx(JpegWith({}), 3600, 2400), 0.0);
  EXPECT_EQ(ReadFocalLengthPx(JpegWith({{41989, 3, 0}}), 3600, 2400), 0.0);
  EXPECT_EQ(ReadFocalLengthPx(JpegWith({{41989, 3, 60000}}), 3600, 2400), 0.0);
  EXPECT_EQ(ReadFocalLengthPx(JpegWith({{37386, 5, 35, 0}, {41486, 5, 1, 1}}), 3600, 2400), 0.0);
}

// With any wrong byte the result is plausible, and nothing outside the file is read.
TEST(FocalLength, DamagedFilesAreHarmless) {
  const std::string jpeg = JpegWith({{37386, 5, 350, 10}, {41486, 5, 1000, 1}});
  for (size_t at = 2; at < 120; ++at) {
    for (const char value : {'\0', '\xFF', '\x7F'}) {
      std::string damaged = jpeg;
      damaged[at] = value;
      const double focal = ReadFocalLengthPx(damaged, 3600, 2400);
      EXPECT_TRUE(focal == 0.0 || (focal >= 720.0 && focal <= 28800.0)) << at;
    }
    EXPECT_GE(ReadFocalLengthPx(jpeg.substr(0, at), 3600, 2400), 0.0);
  }
}

}  // namespace
}  // namespace color3d
