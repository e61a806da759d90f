// Formats that are read but not written, and files that refer to other files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/random.h"
#include "core/image/codec.h"
#include "core/image/probe/focal_length.h"
#include "core/image/probe/orientation.h"
#include "tests/support/formats/picture_files.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

std::string Refusal(const std::string& bytes, const std::string& name) {
  try {
    DecodeImage(bytes, name);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

// Smooth, so that lossy formats keep it.
Image Ramp(int width, int height) {
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.At(0, y, x) = static_cast<float>(x) / static_cast<float>(width);
      image.At(1, y, x) = static_cast<float>(y) / static_cast<float>(height);
      image.At(2, y, x) = 0.3f;
    }
  }
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

TEST(ForeignFormats, ReadsWebpAndBmp) {
  const Image image = Ramp(31, 20);
  EXPECT_LT(WorstDifference(DecodeImage(WebpFile(image), "a.webp"), image), 0.003);
  EXPECT_LT(WorstDifference(DecodeImage(BmpFile(image), "a.bmp"), image), 0.003);
  EXPECT_EQ(ProbeImage(WebpFile(image), "a").format, ImageFormat::kWebp);
  EXPECT_EQ(ProbeImage(BmpFile(image), "a").format, ImageFormat::kBmp);
}

TEST(ForeignFormats, ReadsLossyWebpWithAlpha) {
  cv::Mat mat(20, 31, CV_8UC4, cv::Scalar(50, 120, 200, 255));
  mat(cv::Rect(0, 0, 8, 20)).setTo(cv::Scalar(50, 120, 200, 0));
  std::vector<uchar> bytes;
  cv::imencode(".webp", mat, bytes, {cv::IMWRITE_WEBP_QUALITY, 90});
  const Image image =
      DecodeImage({reinterpret_cast<char*>(bytes.data()), bytes.size()}, "a.webp", true);
  ASSERT_EQ(image.channels, 4);
  EXPECT_NEAR(image.At(0, 10, 20), 200.0 / 255, 0.03);
  EXPECT_NEAR(image.At(2, 10, 20), 50.0 / 255, 0.03);
  EXPECT_EQ(image.At(3, 10, 2), 0.0f);
  EXPECT_EQ(image.At(3, 10, 20), 1.0f);
}

TEST(ForeignFormats, ReadsBmpsOfAllHeaders) {
  const Image image = Ramp(5, 4);
  const std::string bmp = BmpFile(image);
  // Rows from top to bottom.
  std::string turned = bmp;
  turned.replace(22, 4, "\xFC\xFF\xFF\xFF");
  const Image from_top = DecodeImage(turned, "a.bmp");
  EXPECT_NEAR(from_top.At(1, 0, 0), image.At(1, 3, 0), 0.003);
  // OS/2's: 12 bytes.
  std::string os2 =
      bmp.substr(0, 10) + std::string("\x1A\0\0\0\x0C\0\0\0\x05\0\x04\0\x01\0\x18\0", 16);
  os2 += bmp.substr(54);
  EXPECT_LT(WorstDifference(DecodeImage(os2, "a.bmp"), image), 0.003);
  // Grey palette.
  std::vector<uchar> gray;
  cv::imencode(".bmp", cv::Mat(4, 5, CV_8UC1, cv::Scalar(77)), gray);
  const Image read = DecodeImage({reinterpret_cast<char*>(gray.data()), gray.size()}, "a.bmp");
  EXPECT_EQ(read.channels, 1);
  EXPECT_NEAR(read.At(0, 1, 1), 77.0 / 255, 0.003);
  EXPECT_THAT(Refusal("BMX stands for bicycle motocross.", "a.bmp"), HasSubstr("not an image"));
}

TEST(ForeignFormats, RejectsAnimatedWebp) {
  std::string file("RIFF\x1E\0\0\0WEBPVP8X\x0A\0\0\0\x02\0\0\0\x0F\0\0\x0F\0\0", 30);
  file += std::string("ANIM\0\0\0\0", 8);
  EXPECT_THAT(Refusal(file, "a.webp"), HasSubstr("a.webp is an animated WebP"));
}

TEST(ForeignFormats, ReadsHeicOf8And10Bits) {
  const Image image = Ramp(64, 48);
  for (const int bits : {8, 10}) {
    const std::string heic = HeicFile(image, "", bits);
    if (heic.empty()) GTEST_SKIP() << "libheif or its encoder is missing";
    EXPECT_EQ(ProbeImage(heic, "a.heic").format, ImageFormat::kHeif);
    EXPECT_EQ(ReadOrientation(heic), 1);
    EXPECT_LT(WorstDifference(DecodeImage(heic, "a.heic"), image), 0.06) << bits;
  }
}

TEST(ForeignFormats, RejectsTruncatedAndDamagedHeic) {
  const std::string heic = HeicFile(Ramp(64, 48), AdobeRgbProfile());
  if (heic.empty()) GTEST_SKIP() << "libheif or its encoder is missing";
  for (size_t length = 0; length < heic.size(); ++length) {
    const std::vector<char> cut(heic.begin(), heic.begin() + static_cast<ptrdiff_t>(length));
    EXPECT_THROW(ProbeImage({cut.data(), cut.size()}, "a.heic"), Error) << length;
  }
  Random random(6);
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    std::string bytes = heic;
    for (int k = 0; k < 3; ++k) {
      bytes[random.NextBelow(i % 2 == 0 ? 600 : static_cast<uint32_t>(bytes.size()))] ^=
          static_cast<char>(1u << random.NextBelow(8));
    }
    refused += Refusal(bytes, "a.heic").empty() ? 0 : 1;
    ReadFocalLengthPx(bytes, 64, 48);
  }
  EXPECT_GT(refused, 30);
}

TEST(ForeignFormats, UnreadableHeicNamesRemedy) {
  EXPECT_THAT(Refusal(std::string("\0\0\0\x18"
                                  "ftypheic\0\0\0\0mif1heic",
                                  24) +
                          std::string(64, '\0'),
                      "stub.heic"),
              HasSubstr("stub.heic is truncated: it holds no picture"));
  const std::string heic = HeicFile(Ramp(64, 48));
  if (heic.empty()) GTEST_SKIP() << "libheif or its encoder is missing";
  std::string avif = heic;
  avif.replace(avif.find("hvc1"), 4, "av01");
  EXPECT_THAT(Refusal(avif, "a.heic"), HasSubstr("is an AVIF picture"));
  // The picture's location in another file, which the box "dref" names.
  std::string outside = heic;
  const size_t places = outside.find("iloc") + 4;
  const int version = outside[places];
  ASSERT_LE(version, 1);
  const size_t reference = places + 4 + 2 + 2 + 2 + (version == 1 ? 2 : 0);
  outside[reference + 1] = 1;
  EXPECT_THAT(Refusal(outside, "a.heic"), HasSubstr("keeps its picture in another file"));
}

TEST(ForeignFormats, CmykIsRejectedWithRemedy) {
  const std::string cmyk(
      "\xFF\xD8\xFF\xC0\0\x14\x08\0\x10\0\x10\x04\1\x11\0\2\x11\0\3\x11\0\4\x11\0", 24);
  EXPECT_THAT(Refusal(cmyk, "print.jpg"), HasSubstr("print.jpg is in CMYK"));
}

// OpenCV would choose among its decoders, GDAL and GDCM included.
TEST(ForeignFormats, FilesWithReferencesReachNoDecoder) {
  const ScratchFolder folder;
  const std::string secret = (folder.path() / "secret.png").string();
  WriteFileAtomic(secret, EncodePng8(Image(8, 8, 3, 0.5f)));
  const std::string files[] = {
      "<svg xmlns='http://www.w3.org/2000/svg' xmlns:xlink='http://www.w3.org/1999/xlink' "
      "width='8' "
      "height='8'><image xlink:href='" +
          secret + "' width='8' height='8'/></svg>",
      "push graphic-context\nviewbox 0 0 8 8\nimage over 0,0 0,0 '" + secret +
          "'\npop graphic-context\n",
      "<VRTDataset rasterXSize='8' rasterYSize='8'><VRTRasterBand dataType='Byte' band='1'>"
      "<SimpleSource><SourceFilename>" +
          secret +
          "</SourceFilename><SourceBand>1</SourceBand>"
          "</SimpleSource></VRTRasterBand></VRTDataset>",
      "<GDAL_WMS><Service name='TMS'><ServerUrl>file://" + secret +
          "</ServerUrl></Service></GDAL_WMS>",
      "%!PS-Adobe-3.0 EPSF-3.0\n(" + secret + ") run\n",
      "%PDF-1.4\n",
      "#EXTM3U\n" + secret + "\n",
      "P6 8 8 255\n" + std::string(192, 'x'),
      "P7\nWIDTH 8\nHEIGHT 8\nDEPTH 1\nMAXVAL 255\nENDHDR\n" + std::string(64, 'x'),
      "PF\n8 8\n-1.0\n" + std::string(768, 'x'),
      "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 8\n" + std::string(256, 'x'),
      std::string("\x59\xA6\x6A\x95\0\0\0\x08\0\0\0\x08\0\0\0\x08", 16) + std::string(100, 'x'),
      std::string("\x76\x2F\x31\x01\2\0\0\0", 8) + std::string(100, '\0'),
      std::string("\0\0\0\x0CjP  \r\n\x87\n", 12) + std::string(100, '\0'),
      std::string(128, '\0') + "DICM" + std::string(100, '\0'),
      "RIFF" + std::string("\x04\0\0\0", 4) + "WAVE",
      "GIF89a" + std::string(100, '\0')};
  for (const std::string& file : files) {
    for (const char* name : {"a.png", "a.jpg", "a.tif", "a.webp", "a.bmp", "a.heic"}) {
      EXPECT_THAT(Refusal(file, name), HasSubstr("not an image")) << file.substr(0, 40);
    }
  }
}

}  // namespace
}  // namespace color3d
