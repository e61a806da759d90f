#include "core/image/probe/probe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/image/codec.h"
#include "core/image/probe/orientation.h"
#include "tests/support/formats/picture_files.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

std::string Refusal(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

Image Noise(int width, int height, int channels, uint64_t seed = 1) {
  Random random(seed);
  Image image(width, height, channels);
  for (float& v : image.data) v = static_cast<float>(random.NextUniform());
  return image;
}

std::string EncodeTiff(const Image& image, bool sixteen_bits, int compression) {
  const Image decoded = DecodeImage(sixteen_bits ? EncodePng16(image) : EncodePng8(image), "x.png");
  cv::Mat mat(
      image.height, image.width, CV_MAKETYPE(sixteen_bits ? CV_16U : CV_8U, image.channels));
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < image.channels; ++c) {
        const int plane = image.channels == 3 ? 2 - c : c;
        const float v = decoded.At(plane, y, x);
        if (sixteen_bits) {
          mat.ptr<uint16_t>(y)[x * image.channels + c] = static_cast<uint16_t>(v * 65535 + 0.5f);
        } else {
          mat.ptr<uint8_t>(y)[x * image.channels + c] = static_cast<uint8_t>(v * 255 + 0.5f);
        }
      }
    }
  }
  std::vector<uchar> bytes;
  cv::imencode(".tif", mat, bytes, {cv::IMWRITE_TIFF_COMPRESSION, compression});
  return std::string(bytes.begin(), bytes.end());
}

struct Sample {
  std::string name;
  std::string bytes;
  ImageFormat format;
  int bits;
  int channels;
};
std::vector<Sample> Samples() {
  const Image gray = Noise(23, 17, 1);
  const Image rgb = Noise(23, 17, 3);
  const Image rgba = Noise(23, 17, 4);
  std::vector<uchar> progressive;
  cv::imencode(".jpg",
               cv::Mat(17, 23, CV_8UC3, cv::Scalar(9, 99, 199)),
               progressive,
               {cv::IMWRITE_JPEG_PROGRESSIVE, 1, cv::IMWRITE_JPEG_RST_INTERVAL, 1});
  return {{"gray.jpg", EncodeJpeg(gray), ImageFormat::kJpeg, 8, 1},
          {"rgb.jpg", EncodeJpeg(rgb), ImageFormat::kJpeg, 8, 3},
          {"progressive.jpg",
           std::string(progressive.begin(), progressive.end()),
           ImageFormat::kJpeg,
           8,
           3},
          {"gray8.png", EncodePng8(gray), ImageFormat::kPng, 8, 1},
          {"gray16.png", EncodePng16(gray), ImageFormat::kPng, 16, 1},
          {"rgb16.png", EncodePng16(rgb), ImageFormat::kPng, 16, 3},
          {"rgba.png", EncodePng8(rgba), ImageFormat::kPng, 8, 4},
          {"gray16.tif", EncodeTiff(gray, true, 1), ImageFormat::kTiff, 16, 1},
          {"rgb8.tif", EncodeTiff(rgb, false, 5), ImageFormat::kTiff, 8, 3},
          {"a.webp", WebpFile(rgb), ImageFormat::kWebp, 8, 3},
          {"profile.webp", WebpFile(rgb, AdobeRgbProfile()), ImageFormat::kWebp, 8, 3},
          {"a.bmp", BmpFile(rgb), ImageFormat::kBmp, 8, 3}};
}

TEST(Probe, ReadsTheHeaderOfEveryFormat) {
  for (const Sample& sample : Samples()) {
    const ImageInfo info = ProbeImage(sample.bytes, sample.name);
    EXPECT_EQ(info.format, sample.format) << sample.name;
    EXPECT_EQ(info.width, 23) << sample.name;
    EXPECT_EQ(info.height, 17) << sample.name;
    EXPECT_EQ(info.bits_per_channel, sample.bits) << sample.name;
    EXPECT_EQ(info.channels, sample.channels) << sample.name;
    EXPECT_EQ(ReadOrientation(sample.bytes), 1) << sample.name;
  }
}

TEST(Probe, NamesEveryTruncatedFile) {
  for (const Sample& sample : Samples()) {
    for (size_t length = 0; length < sample.bytes.size(); ++length) {
      // A heap copy of the exact size, so that an address sanitizer reports the first byte beyond.
      const std::vector<char> cut(sample.bytes.begin(), sample.bytes.begin() + length);
      const std::string_view view(cut.data(), cut.size());
      const std::string said = Refusal([&] { ProbeImage(view, sample.name); });
      // A TIFF may end with its directory's last padding byte missing; nothing else is optional.
      if (said.empty() && sample.format == ImageFormat::kTiff &&
          length + 8 >= sample.bytes.size()) {
        continue;
      }
      ASSERT_THAT(said, HasSubstr(sample.name)) << length << " of " << sample.bytes.size();
      EXPECT_EQ(said.find('\n'), std::string::npos);
      if (length > 8 && sample.format != ImageFormat::kTiff) {
        ASSERT_THAT(said, HasSubstr("is truncated")) << sample.name << " " << length;
      }
      ReadOrientation(view);
    }
  }
}

TEST(Probe, ByteFlipsNeverCrashProbeOrDecoder) {
  Random random(9);
  int refused = 0, total = 0;
  for (const Sample& sample : Samples()) {
    for (int i = 0; i < 300; ++i) {
      std::string bytes = sample.bytes;
      const int flips = 1 + static_cast<int>(random.NextBelow(4));
      for (int k = 0; k < flips; ++k) {
        bytes[random.NextBelow(static_cast<uint32_t>(bytes.size()))] ^=
            static_cast<char>(1u << random.NextBelow(8));
      }
      ++total;
      const std::string said = Refusal([&] {
        const Image image = DecodeImage(bytes, sample.name);
        EXPECT_EQ(image.data.size(), image.PlaneSize() * image.channels);
      });
      refused += said.empty() ? 0 : 1;
      ReadOrientation(bytes);
    }
  }
  EXPECT_GT(refused, total / 4);
}

TEST(Probe, RejectsOtherFiles) {
  EXPECT_EQ(Refusal([] { ProbeImage("Buy milk.\n", "notes.jpg"); }),
            "notes.jpg is not an image (" + ReadableImageFormats() + ")");
  EXPECT_EQ(Refusal([] { ProbeImage("", "empty.png"); }),
            "empty.png is empty, not an image (" + ReadableImageFormats() + ")");
  EXPECT_THAT(Refusal([] { ProbeImage("\xFF", "one.jpg"); }), HasSubstr("is not an image"));
  EXPECT_THAT(Refusal([] { ProbeImage("\xFF\xD8 DICM \xFF\xD9", "dicom.jpg"); }),
              HasSubstr("is not an image"))
      << "OpenCV would look for another reader";
  EXPECT_THAT(Refusal([] { ProbeImage(std::string("II*\0", 4), "four.tif"); }),
              HasSubstr("is truncated"));
  EXPECT_THAT(Refusal([] { ProbeImage(std::string("II+\0\x08\0\0\0", 8), "big.tif"); }),
              HasSubstr("BigTIFF"));
}

// A PNG of one chunk with a valid checksum.
std::string PngClaiming(uint32_t width, uint32_t height) {
  std::string header("IHDR", 4);
  for (uint32_t v : {width, height}) {
    for (int shift = 24; shift >= 0; shift -= 8) header += static_cast<char>(v >> shift & 255u);
  }
  header += std::string("\x08\x02\0\0\0", 5);
  const uLong crc = ::crc32_z(0, reinterpret_cast<const Bytef*>(header.data()), header.size());
  std::string bytes("\x89PNG\r\n\x1A\n\0\0\0\x0D", 12);
  bytes += header;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(crc >> shift & 255u);
  return bytes;
}

TEST(Probe, RejectsBombsByHeader) {
  EXPECT_THAT(Refusal([] { ProbeImage(PngClaiming(60000, 60000), "bomb.png"); }),
              HasSubstr("bomb.png claims 60000 x 60000 px; the limit is 30000 px a side"));
  EXPECT_THAT(Refusal([] { ProbeImage(PngClaiming(20000, 20000), "bomb.png"); }),
              HasSubstr("200000000 px in all"));
  EXPECT_THAT(Refusal([] { ProbeImage(PngClaiming(0xFFFFFFFFu, 1), "bomb.png"); }),
              HasSubstr("bomb.png claims"));
  EXPECT_THAT(Refusal([] { ProbeImage(PngClaiming(0, 7), "none.png"); }), HasSubstr("0 x 7 px"));
  ImageLimits limits;
  limits.max_pixels = 300;
  const std::string small = EncodePng8(Noise(23, 17, 1));
  EXPECT_THAT(Refusal([&] { ProbeImage(small, "a.png", limits); }), HasSubstr("23 x 17"));
  // A valid header with hardly any data after it.
  const std::string iend("\0\0\0\0IEND\xAE\x42\x60\x82", 12);
  EXPECT_THAT(Refusal([&] { ProbeImage(PngClaiming(10000, 10000) + iend, "thin.png"); }),
              HasSubstr("holds no image data"));
}

TEST(Probe, AcceptsTrailingBytes) {
  for (const Sample& sample : Samples()) {
    const std::string more = sample.bytes + std::string(1000, '\xFF') + "trailer";
    EXPECT_NO_THROW(ProbeImage(more, sample.name)) << sample.name;
    EXPECT_NO_THROW(DecodeImage(more, sample.name)) << sample.name;
  }
}

TEST(Probe, ReportsWrongChecksum) {
  std::string bytes = EncodePng8(Noise(23, 17, 3));
  bytes[bytes.size() / 2] ^= 0x10;
  EXPECT_THAT(Refusal([&] { ProbeImage(bytes, "a.png"); }), HasSubstr("checksum"));
}

TEST(Probe, KnowsExtensions) {
  EXPECT_EQ(HasImageExtension("a.HEIC"), ReadsHeif());
  EXPECT_EQ(ReadableImageFormats().find("HEIC") != std::string::npos, ReadsHeif());
  EXPECT_THAT(ReadableImageEndings(), HasSubstr(".jpg, .jpeg, "));
  for (const char* name :
       {"a.jpg", "B.JPEG", "dir.x/c.PnG", "d.tif", "e.TIFF", "f.WebP", "g.bmp", "h.jfif"}) {
    EXPECT_TRUE(HasImageExtension(name)) << name;
  }
  for (const char* name : {"jpg", "a.jpgx", "a.gif", "a.jpg/b", "", ".", "a.txt"}) {
    EXPECT_FALSE(HasImageExtension(name)) << name;
  }
}

}  // namespace
}  // namespace color3d
