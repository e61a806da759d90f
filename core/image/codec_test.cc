#include "core/image/codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/random.h"
#include "core/image/probe/orientation.h"
#include "core/image/reduced.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

Image Noise(int width, int height, int channels) {
  Random random(5);
  Image image(width, height, channels);
  for (float& v : image.data) v = static_cast<float>(random.NextUniform());
  return image;
}

double WorstDifference(const Image& x, const Image& y) {
  EXPECT_EQ(x.width, y.width);
  EXPECT_EQ(x.height, y.height);
  EXPECT_EQ(x.channels, y.channels);
  double worst = x.data.size() == y.data.size() ? 0.0 : 1e9;
  for (size_t i = 0; i < std::min(x.data.size(), y.data.size()); ++i) {
    worst = std::max(worst, static_cast<double>(std::abs(x.data[i] - y.data[i])));
  }
  return worst;
}

void AppendInteger(std::string* bytes, uint32_t value, int count, bool big_endian) {
  for (int i = 0; i < count; ++i) {
    const int shift = 8 * (big_endian ? count - 1 - i : i);
    *bytes += static_cast<char>(value >> shift & 255u);
  }
}

// An uncompressed TIFF written by hand: one strip, grey, `bits` per sample.
std::string HandMadeTiff(int width,
                         int height,
                         int bits,
                         int photometric,
                         int orientation,
                         bool big_endian,
                         const std::vector<uint32_t>& samples) {
  std::string data;
  if (bits == 1) {
    const size_t row_bytes = static_cast<size_t>(width + 7) / 8;
    data.assign(row_bytes * height, '\0');
    for (int i = 0; i < width * height; ++i) {
      const size_t x = i % width;
      if (samples[i] != 0) {
        data[row_bytes * (i / width) + x / 8] |= static_cast<char>(0x80u >> (x % 8));
      }
    }
  } else {
    for (uint32_t v : samples) AppendInteger(&data, v, bits / 8, big_endian);
  }
  std::string tiff = big_endian ? std::string("MM\0*", 4) : std::string("II*\0", 4);
  const uint32_t padded = static_cast<uint32_t>(data.size() + data.size() % 2);
  AppendInteger(&tiff, 8 + padded, 4, big_endian);
  tiff += data;
  tiff.resize(8 + padded);
  const std::vector<std::array<uint32_t, 2>> tags = {{256, static_cast<uint32_t>(width)},
                                                     {257, static_cast<uint32_t>(height)},
                                                     {258, static_cast<uint32_t>(bits)},
                                                     {259, 1},
                                                     {262, static_cast<uint32_t>(photometric)},
                                                     {273, 8},
                                                     {274, static_cast<uint32_t>(orientation)},
                                                     {277, 1},
                                                     {278, static_cast<uint32_t>(height)},
                                                     {279, static_cast<uint32_t>(data.size())}};
  AppendInteger(&tiff, static_cast<uint32_t>(tags.size()), 2, big_endian);
  for (const auto& [tag, value] : tags) {
    AppendInteger(&tiff, tag, 2, big_endian);
    AppendInteger(&tiff, 3, 2, big_endian);
    AppendInteger(&tiff, 1, 4, big_endian);
    AppendInteger(&tiff, value, 2, big_endian);
    AppendInteger(&tiff, 0, 2, big_endian);
  }
  AppendInteger(&tiff, 0, 4, big_endian);
  return tiff;
}

TEST(Codec, PngRoundTripsKeepPrecisionAndChannels) {
  for (int channels : {1, 3, 4}) {
    const Image image = Noise(31, 20, channels);
    const bool keep_alpha = channels == 4;
    EXPECT_LE(WorstDifference(DecodeImage(EncodePng8(image), "a.png", keep_alpha), image),
              0.5 / 255 + 1e-6);
    EXPECT_LE(WorstDifference(DecodeImage(EncodePng16(image), "a.png", keep_alpha), image),
              0.5 / 65535 + 1e-6);
  }
  EXPECT_EQ(DecodeImage(EncodePng8(Noise(5, 4, 4)), "a.png").channels, 3);
}

TEST(Codec, ColorsAreInTheRightOrder) {
  Image image(16, 16, 3);
  std::fill_n(image.Plane(0), 256, 0.9f);
  std::fill_n(image.Plane(1), 256, 0.5f);
  std::fill_n(image.Plane(2), 256, 0.1f);
  for (const std::string& bytes : {EncodePng8(image), EncodeJpeg(image, 95)}) {
    const Image again = DecodeImage(bytes, "a");
    EXPECT_NEAR(again.At(0, 8, 8), 0.9, 0.02);
    EXPECT_NEAR(again.At(1, 8, 8), 0.5, 0.02);
    EXPECT_NEAR(again.At(2, 8, 8), 0.1, 0.02);
  }
}

TEST(Codec, GrayKeepsOneChannelAndClamps) {
  Image image(9, 7, 1, 0.25f);
  image.At(0, 0, 0) = -3.0f;
  image.At(0, 0, 1) = 7.0f;
  image.At(0, 0, 2) = std::nanf("");
  const Image again = DecodeImage(EncodePng16(image), "a.png");
  EXPECT_EQ(again.channels, 1);
  EXPECT_EQ(again.At(0, 0, 0), 0.0f);
  EXPECT_EQ(again.At(0, 0, 1), 1.0f);
  EXPECT_EQ(again.At(0, 0, 2), 0.0f);
  EXPECT_EQ(DecodeImage(EncodeJpeg(image), "a.jpg").channels, 1);
}

// A marked corner distinguishes all eight orientations. Positions of the stored pixel (0, 0) and
// the next one in its row, from the EXIF standard's table.
struct Expected {
  int orientation;
  bool origin_right, origin_bottom;  // position of the stored (0, 0)
  bool row_is_vertical;              // the stored row 0 becomes a column
};
constexpr Expected kOrientations[] = {{1, false, false, false},
                                      {2, true, false, false},
                                      {3, true, true, false},
                                      {4, false, true, false},
                                      {5, false, false, true},
                                      {6, true, false, true},
                                      {7, true, true, true},
                                      {8, false, true, true}};

void CheckOriented(const Image& seen, const Expected& expected, const std::string& what) {
  ASSERT_EQ(seen.width, expected.row_is_vertical ? 4 : 6) << what;
  ASSERT_EQ(seen.height, expected.row_is_vertical ? 6 : 4) << what;
  const int x0 = expected.origin_right ? seen.width - 1 : 0;
  const int y0 = expected.origin_bottom ? seen.height - 1 : 0;
  const int dx = expected.row_is_vertical ? 0 : (expected.origin_right ? -1 : 1);
  const int dy = expected.row_is_vertical ? (expected.origin_bottom ? -1 : 1) : 0;
  EXPECT_NEAR(seen.At(0, y0, x0), 1.0, 1e-6) << what;
  EXPECT_NEAR(seen.At(0, y0 + dy, x0 + dx), 0.5, 0.01) << what;
  EXPECT_NEAR(seen.At(0, y0 + 2 * dy, x0 + 2 * dx), 0.0, 1e-6) << what;
}

TEST(Codec, AllEightOrientationsOf8And16BitTiff) {
  for (const Expected& expected : kOrientations) {
    for (int bits : {8, 16}) {
      for (bool big_endian : {false, true}) {
        const uint32_t top = bits == 8 ? 255 : 65535;
        std::vector<uint32_t> samples(6 * 4, 0);
        samples[0] = top;
        samples[1] = top / 2;
        const std::string tiff =
            HandMadeTiff(6, 4, bits, 1, expected.orientation, big_endian, samples);
        ASSERT_EQ(ReadOrientation(tiff), expected.orientation);
        CheckOriented(DecodeImage(tiff, "a.tif"),
                      expected,
                      std::to_string(expected.orientation) + " bits " + std::to_string(bits));
      }
    }
  }
}

// APP1 right after SOI, or an eXIf chunk before IDAT.
std::string WithExif(const std::string& bytes, int orientation) {
  std::string tiff("II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0", 18);
  AppendInteger(&tiff, static_cast<uint32_t>(orientation), 4, false);
  AppendInteger(&tiff, 0, 4, false);
  if (bytes[0] == '\xFF') {
    std::string segment("\xFF\xE1", 2);
    AppendInteger(&segment, static_cast<uint32_t>(2 + 6 + tiff.size()), 2, true);
    segment += std::string("Exif\0\0", 6) + tiff;
    return bytes.substr(0, 2) + segment + bytes.substr(2);
  }
  std::string body = "eXIf" + tiff;
  const uLong crc = ::crc32_z(0, reinterpret_cast<const Bytef*>(body.data()), body.size());
  std::string chunk;
  AppendInteger(&chunk, static_cast<uint32_t>(tiff.size()), 4, true);
  chunk += body;
  AppendInteger(&chunk, static_cast<uint32_t>(crc), 4, true);
  return bytes.substr(0, 33) + chunk + bytes.substr(33);
}

TEST(Codec, AllEightOrientationsOfPngAnd16BitIsKept) {
  Image stored(6, 4, 1);
  stored.At(0, 0, 0) = 1.0f;
  stored.At(0, 0, 1) = 32768.0f / 65535.0f;
  for (const Expected& expected : kOrientations) {
    const std::string png = WithExif(EncodePng16(stored), expected.orientation);
    const Image seen = DecodeImage(png, "a.png");
    CheckOriented(seen, expected, std::to_string(expected.orientation));
    EXPECT_NE(std::find(seen.data.begin(), seen.data.end(), 32768.0f * (1.0f / 65535.0f)),
              seen.data.end());
  }
}

TEST(Codec, OrientedJpegAgreesWithOpenCv) {
  Image stored(48, 32, 3);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 48; ++x) {
      stored.At(0, y, x) = x / 48.0f;
      stored.At(1, y, x) = y / 32.0f;
      stored.At(2, y, x) = 0.3f;
    }
  }
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const std::string jpeg = WithExif(EncodeJpeg(stored), orientation);
    const Image seen = DecodeImage(jpeg, "a.jpg");
    const cv::Mat mat = cv::imdecode(
        cv::Mat(1, static_cast<int>(jpeg.size()), CV_8U, const_cast<char*>(jpeg.data())),
        cv::IMREAD_COLOR);
    ASSERT_EQ(seen.width, mat.cols) << orientation;
    ASSERT_EQ(seen.height, mat.rows) << orientation;
    for (int y = 0; y < mat.rows; ++y) {
      for (int x = 0; x < mat.cols; ++x) {
        ASSERT_NEAR(seen.At(0, y, x) * 255, mat.at<cv::Vec3b>(y, x)[2], 0.01) << orientation;
        ASSERT_NEAR(seen.At(1, y, x) * 255, mat.at<cv::Vec3b>(y, x)[1], 0.01) << orientation;
      }
    }
  }
}

TEST(Codec, ReadsMinIsWhiteAndBilevelTiffs) {
  for (int photometric : {0, 1}) {
    for (int bits : {1, 8, 16}) {
      const uint32_t top = bits == 1 ? 1 : bits == 8 ? 255 : 65535;
      std::vector<uint32_t> samples(16 * 2, 0);
      samples[3] = top;
      const std::string tiff = HandMadeTiff(16, 2, bits, photometric, 1, false, samples);
      const Image image = DecodeImage(tiff, "scan.tif");
      const std::string what = std::to_string(photometric) + " " + std::to_string(bits);
      ASSERT_EQ(image.channels, 1) << what;
      EXPECT_NEAR(image.At(0, 0, 3), photometric, 1e-6) << what;
      EXPECT_NEAR(image.At(0, 1, 3), 1 - photometric, 1e-6) << what;
    }
  }
}

TEST(Codec, IsGray) {
  EXPECT_TRUE(IsGray(Noise(10, 10, 1)));
  Image image(100, 10, 3, 0.5f);
  EXPECT_TRUE(IsGray(image));
  for (int i = 0; i < 5; ++i) image.At(0, 0, i) = 0.9f;
  EXPECT_TRUE(IsGray(image));  // 0.5 % of the pixels
  image.At(0, 0, 5) = 0.9f;
  EXPECT_FALSE(IsGray(image));
  EXPECT_TRUE(IsGray(image, 0.5f));
}

TEST(Codec, AbMapsRoundTrip) {
  Random random(8);
  Image ab(40, 30, 2);
  for (float& v : ab.data) v = static_cast<float>(random.NextUniform(-128, 127));
  const Image confidence = Noise(40, 30, 1);
  const AbMap map = DecodeAbPng(EncodeAbPng(ab, confidence), "ab.png");
  EXPECT_LT(WorstDifference(map.ab, ab), 0.004);
  EXPECT_LT(WorstDifference(map.confidence, confidence), 1e-5);
  const AbMap sure = DecodeAbPng(EncodeAbPng(ab), "ab.png");
  EXPECT_EQ(WorstDifference(sure.confidence, Image(40, 30, 1, 1.0f)), 0.0);
  EXPECT_THROW(EncodeAbPng(Image(4, 4, 3)), Error);
  EXPECT_THROW(EncodeAbPng(ab, Image(4, 4, 1)), Error);
  EXPECT_THROW(DecodeAbPng(EncodePng8(Noise(4, 4, 3)), "x.png"), Error);
}

TEST(Codec, ReadsFilesAndNamesErrors) {
  const ScratchFolder folder;
  const Image image = Noise(12, 9, 3);
  WriteFileAtomic(folder.path() / "a.png", EncodePng8(image));
  EXPECT_LE(WorstDifference(ReadImage(folder.path() / "a.png"), image), 0.5 / 255 + 1e-6);
  EXPECT_THROW(ReadImage(folder.path() / "missing.png"), Error);
  EXPECT_THROW(EncodePng8(Image()), Error);
  EXPECT_THROW(EncodePng8(Image(2, 2, 2)), Error);
  EXPECT_THROW(EncodeJpeg(Image(2, 2, 4)), Error);
  EXPECT_THROW(EncodeJpeg(image, 0), Error);
}

TEST(Codec, RoundTripsOddSizes) {
  for (auto [width, height] : {std::pair{1, 1}, {1, 300}, {8000, 1}}) {
    const Image image = Noise(width, height, 1);
    EXPECT_LE(WorstDifference(DecodeImage(EncodePng16(image), "a.png"), image), 1e-5);
  }
}

TEST(ReadImageWithinTest, LargeJpegsKeepLookOrientationAndChannels) {
  Image image(1601, 1203, 3);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      image.At(0, y, x) = static_cast<float>(x) / 1601.0f;
      image.At(1, y, x) = static_cast<float>(y) / 1203.0f;
      image.At(2, y, x) = 0.4f;
    }
  }
  const ScratchFolder folder;
  for (int channels : {1, 3}) {
    Image written(image.width, image.height, channels);
    std::copy_n(image.data.begin(), written.data.size(), written.data.begin());
    WriteFileAtomic(folder.path() / "a.jpg", EncodeJpeg(written, 95));
    const Image small = ReadImageWithin(folder.path() / "a.jpg", 160);
    const Image expected = FitWithin(ReadImage(folder.path() / "a.jpg"), 160);
    ASSERT_EQ(small.width, 160);
    ASSERT_EQ(small.height, expected.height);
    ASSERT_EQ(small.channels, channels);
    for (size_t i = 0; i < small.data.size(); ++i) {
      ASSERT_NEAR(small.data[i], expected.data[i], 0.02f);
    }
    WriteFileAtomic(folder.path() / "a.png", EncodePng8(written));
    EXPECT_EQ(ReadImageWithin(folder.path() / "a.png", 160).data,
              FitWithin(ReadImage(folder.path() / "a.png"), 160).data);
  }
  EXPECT_EQ(ReadImageWithin(folder.path() / "a.png", 5000).width, 1601);
  EXPECT_THROW(ReadImageWithin(folder.path() / "a.png", 0), Error);
}

}  // namespace
}  // namespace color3d
