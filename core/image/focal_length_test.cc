#include "core/image/focal_length.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "core/image/codec.h"

namespace color3d {
namespace {

struct Tag {
  uint32_t number;
  uint32_t type;  // 3 SHORT, 4 LONG, 5 RATIONAL
  uint32_t value;
  uint32_t denominator = 1;
};

void Put(std::string* out, uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out->push_back(static_cast<char>(value >> (8 * i)));
}

// A little-endian EXIF block: a first directory that only names the photo directory, and that.
std::string ExifBlock(const std::vector<Tag>& tags) {
  std::string block("II*\0", 4);
  Put(&block, 8, 4);
  Put(&block, 1, 2);
  Put(&block, 34665, 2), Put(&block, 4, 2), Put(&block, 1, 4), Put(&block, 26, 4);
  Put(&block, 0, 4);
  Put(&block, static_cast<uint32_t>(tags.size()), 2);
  const uint32_t behind = 26 + 2 + 12 * static_cast<uint32_t>(tags.size()) + 4;
  std::string rationals;
  for (const Tag& tag : tags) {
    Put(&block, tag.number, 2), Put(&block, tag.type, 2), Put(&block, 1, 4);
    const bool rational = tag.type == 5;
    Put(&block, rational ? behind + static_cast<uint32_t>(rationals.size()) : tag.value, 4);
    if (rational) Put(&rationals, tag.value, 4), Put(&rationals, tag.denominator, 4);
  }
  Put(&block, 0, 4);
  return block + rationals;
}

std::string JpegWith(const std::vector<Tag>& tags) {
  const std::string jpeg = EncodeJpeg(Image(8, 6, 1, 0.5f));
  const std::string body = std::string("Exif\0\0", 6) + ExifBlock(tags);
  const size_t length = body.size() + 2;
  std::string segment = "\xFF\xE1";
  segment.push_back(static_cast<char>(length >> 8));
  segment.push_back(static_cast<char>(length));
  return jpeg.substr(0, 2) + segment + body + jpeg.substr(2);
}

TEST(FocalLength, FilmEquivalentKeepsTheDiagonal) {
  // 28 mm before 36 x 24 mm film.
  EXPECT_NEAR(ReadFocalLengthPx(JpegWith({{41989, 3, 28}}), 3600, 2400), 2800.0, 0.5);
  EXPECT_NEAR(
      ReadFocalLengthPx(JpegWith({{41989, 3, 28}}), 4000, 3000), 28.0 / 43.2666 * 5000.0, 0.5);
}

TEST(FocalLength, SensorResolutionOfAReducedCopy) {
  // 35 mm, 1000 px per cm when taken at 3000 px; the copy has 1500.
  const std::string jpeg =
      JpegWith({{37386, 5, 350, 10}, {40962, 4, 3000}, {41486, 5, 1000, 1}, {41488, 3, 3}});
  EXPECT_NEAR(ReadFocalLengthPx(jpeg, 3000, 2000), 3500.0, 1e-6);
  EXPECT_NEAR(ReadFocalLengthPx(jpeg, 1500, 1000), 1750.0, 1e-6);
}

TEST(FocalLength, UnknownAndAbsurdAreZero) {
  EXPECT_EQ(ReadFocalLengthPx("", 100, 100), 0.0);
  EXPECT_EQ(ReadFocalLengthPx(EncodePng8(Image(8, 6, 1)), 8, 6), 0.0);
  EXPECT_EQ(ReadFocalLengthPx(JpegWith({}), 3600, 2400), 0.0);
  EXPECT_EQ(ReadFocalLengthPx(JpegWith({{41989, 3, 0}}), 3600, 2400), 0.0);
  EXPECT_EQ(ReadFocalLengthPx(JpegWith({{41989, 3, 60000}}), 3600, 2400), 0.0);
  EXPECT_EQ(ReadFocalLengthPx(JpegWith({{37386, 5, 35, 0}, {41486, 5, 1, 1}}), 3600, 2400), 0.0);
}

// Any byte may be wrong: the answer is a sane number, and nothing outside of the file is read.
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
