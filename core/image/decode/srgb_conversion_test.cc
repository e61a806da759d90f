#include "core/image/decode/srgb_conversion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/base/files.h"
#include "core/base/random.h"
#include "core/image/codec.h"
#include "tests/support/formats/picture_files.h"
#include "tests/support/scenes/test_exif.h"

namespace color3d {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Colours inside all of the spaces, away from their edges.
Image Colors(int channels) {
  Image image(12, 9, channels);
  Random random(3);
  for (float& value : image.data) value = static_cast<float>(0.15 + 0.7 * random.NextUniform());
  return image;
}

double WorstDifference(const Image& x, const Image& y) {
  EXPECT_EQ(x.channels, y.channels);
  EXPECT_EQ(x.data.size(), y.data.size());
  double worst = 0.0;
  for (size_t i = 0; i < std::min(x.data.size(), y.data.size()); ++i) {
    worst = std::max(worst, static_cast<double>(std::abs(x.data[i] - y.data[i])));
  }
  return worst;
}

struct Container {
  const char* name;
  std::function<std::string(const Image&, const std::string& profile)> write;
  double step;  // rounding step, of 0..1
};
std::vector<Container> Containers() {
  const auto tiff = [](int bits) {
    return [bits](const Image& image, const std::string& profile) {
      return TiffFile({{.image = image,
                        .bits = bits,
                        .photometric = image.channels == 3 ? 2u : 1u,
                        .profile = profile}});
    };
  };
  return {{"8-bit PNG",
           [](const Image& image, const std::string& profile) {
             return WithPngProfile(EncodePng8(image), profile);
           },
           1.0 / 255},
          {"16-bit PNG",
           [](const Image& image, const std::string& profile) {
             return WithPngProfile(EncodePng16(image), profile);
           },
           1.0 / 65535},
          {"8-bit TIFF", tiff(8), 1.0 / 255},
          {"16-bit TIFF", tiff(16), 1.0 / 65535},
          {"WebP", &WebpFile, 1.0 / 255},
          {"BMP", &BmpFile, 1.0 / 255}};
}

TEST(SrgbConversion, OtherColorSpacesMatchSrgbCopies) {
  const Image srgb = Colors(3);
  for (const Container& container : Containers()) {
    for (const auto& [name, profile, stretch] : {std::tuple{"Adobe RGB", AdobeRgbProfile(), 3.0},
                                                 {"ProPhoto", ProPhotoProfile(), 6.0},
                                                 {"Display P3", DisplayP3Profile(), 3.0}}) {
      const Image other = ConvertToProfile(srgb, profile);
      ASSERT_GT(WorstDifference(other, srgb), 0.03);
      const Image read = DecodeImage(container.write(other, profile), "a");
      EXPECT_LT(WorstDifference(read, srgb), stretch * container.step + 1e-4)
          << container.name << " in " << name;
    }
  }
}

TEST(SrgbConversion, GrayPicturesKeepOneChannelWithSrgbTones) {
  const Image srgb = Colors(1);
  for (const Container& container : Containers()) {
    const std::string name = container.name;
    if (name == "WebP" || name == "BMP") continue;  // without grey
    for (const std::string& profile :
         {GrayGammaProfile(1.8), GrayGammaProfile(2.2), DotGainProfile(20.0)}) {
      const Image other = ConvertToProfile(srgb, profile);
      ASSERT_GT(WorstDifference(other, srgb), 0.005);
      const Image read = DecodeImage(container.write(other, profile), "a");
      EXPECT_EQ(read.channels, 1);
      EXPECT_LT(WorstDifference(read, srgb), 3.0 * container.step + 2e-4) << name;
    }
  }
}

TEST(SrgbConversion, GrayPictureFollowsColorProfile) {
  const Image srgb = Colors(1);
  Image three(srgb.width, srgb.height, 3);
  for (int c = 0; c < 3; ++c) std::copy(srgb.data.begin(), srgb.data.end(), three.Plane(c));
  const Image adobe = ConvertToProfile(three, AdobeRgbProfile());
  Image gray(srgb.width, srgb.height, 1);
  std::copy_n(adobe.Plane(1), gray.data.size(), gray.data.begin());
  const Image read = DecodeImage(WithPngProfile(EncodePng16(gray), AdobeRgbProfile()), "a");
  EXPECT_LT(WorstDifference(read, srgb), 2e-4);
}

// Our JPEG without its profile.
std::string UntaggedJpeg(const Image& image) {
  const std::string jpeg = EncodeJpeg(image, 98);
  const size_t at = jpeg.find("\xFF\xE2");
  const size_t length =
      static_cast<unsigned char>(jpeg[at + 2]) * 256u + static_cast<unsigned char>(jpeg[at + 3]);
  return jpeg.substr(0, at) + jpeg.substr(at + 2 + length);
}

TEST(SrgbConversion, JoinsProfileChunksOfJpeg) {
  Image srgb(16, 16, 3, 0.5f);
  std::fill_n(srgb.Plane(0), srgb.PlaneSize(), 0.8f);
  const std::string profile = AdobeRgbProfile();
  const std::string plain = UntaggedJpeg(ConvertToProfile(srgb, profile));
  const auto at = [&](const std::string& jpeg, int channel) {
    return DecodeImage(jpeg, "a.jpg").At(channel, 8, 8);
  };
  for (const size_t part_bytes : {size_t{65000}, size_t{100}}) {
    const std::string jpeg = WithJpegProfile(plain, profile, part_bytes);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(at(jpeg, c), srgb.At(c, 8, 8), 0.015) << part_bytes;
    EXPECT_THAT(PictureNotes(jpeg), IsEmpty());
  }
  EXPECT_GT(std::abs(at(plain, 0) - 0.8), 0.03);
}

TEST(SrgbConversion, AppliesHeicProfile) {
  Image srgb(64, 64, 3, 0.3f);
  std::fill_n(srgb.Plane(0), srgb.PlaneSize(), 0.7f);
  const std::string heic = HeicFile(ConvertToProfile(srgb, AdobeRgbProfile()), AdobeRgbProfile());
  if (heic.empty()) GTEST_SKIP() << "libheif or its encoder is missing";
  const Image read = DecodeImage(heic, "a.heic");
  EXPECT_NEAR(read.At(0, 30, 30), 0.7f, 0.02f);
  EXPECT_NEAR(read.At(1, 30, 30), 0.3f, 0.02f);
}

// sRGB's red is 219, 0, 0 in Adobe RGB (1998).
TEST(SrgbConversion, MatchesKnownValues) {
  Image adobe(2, 2, 3, 0.0f);
  std::fill_n(adobe.Plane(0), 4, 219.0f / 255.0f);
  const Image read = DecodeImage(WithPngProfile(EncodePng8(adobe), AdobeRgbProfile()), "a.png");
  EXPECT_NEAR(read.At(0, 0, 0), 1.0, 0.006);
  EXPECT_NEAR(read.At(1, 0, 0), 0.0, 0.006);
  EXPECT_NEAR(read.At(2, 0, 0), 0.0, 0.006);
}

std::string BigEndian(std::initializer_list<uint32_t> values) {
  std::string bytes;
  for (const uint32_t value : values) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 255u);
  }
  return bytes;
}

// Our PNG without its sRGB chunk.
std::string Untagged(const Image& image) {
  const std::string png = EncodePng16(image);
  return png.substr(0, 33) + png.substr(33 + 13);
}

TEST(SrgbConversion, PngChunksHavePrecedence) {
  const std::string linear = BigEndian({100'000}), usual = BigEndian({45'455});
  const std::string adobe = BigEndian({31270, 32900, 64000, 33000, 21000, 71000, 15000, 6000});
  const Image image(4, 4, 3, 0.25f);
  const auto value = [&](const std::string& png) { return DecodeImage(png, "a.png").At(1, 1, 1); };
  const std::string plain = Untagged(image);
  EXPECT_NEAR(value(plain), 0.25, 1e-4);
  EXPECT_NEAR(value(WithPngChunk(plain, "gAMA", usual)), 0.25, 1e-4);
  // Light of a quarter is 0.537 in sRGB.
  EXPECT_NEAR(value(WithPngChunk(plain, "gAMA", linear)), 0.5371, 1e-3);
  EXPECT_NEAR(
      value(WithPngChunk(WithPngChunk(plain, "gAMA", linear), "sRGB", {"\0", 1})), 0.25, 1e-4);
  EXPECT_NEAR(
      value(WithPngProfile(WithPngChunk(plain, "gAMA", linear), SrgbProfile())), 0.25, 1e-4);
  // Primaries, by a colour that is not grey.
  Image red(4, 4, 3, 0.2f);
  std::fill_n(red.Plane(0), 16, 0.7f);
  const Image wide =
      DecodeImage(WithPngChunk(WithPngChunk(Untagged(red), "gAMA", usual), "cHRM", adobe), "a.png");
  const Image same = DecodeImage(WithPngProfile(Untagged(red), AdobeRgbProfile()), "a.png");
  EXPECT_LT(WorstDifference(wide, same), 2e-3);
  EXPECT_GT(wide.At(0, 0, 0), 0.73f);
  EXPECT_THAT(PictureNotes(WithPngChunk(plain, "gAMA", BigEndian({1}))),
              ElementsAre(HasSubstr("gamma")));
}

// A camera's photo of the option "Adobe RGB" without a profile: Interoperability index "R03".
TEST(SrgbConversion, RecognizesAdobeRgbInExif) {
  Image srgb(16, 16, 3, 0.5f);
  std::fill_n(srgb.Plane(0), srgb.PlaneSize(), 0.8f);
  const std::string silent = UntaggedJpeg(ConvertToProfile(srgb, AdobeRgbProfile()));
  std::string block = ExifBlock({{40965, 4, 0}});
  const auto place = static_cast<uint32_t>(block.size());
  block.replace(26 + 2 + 8, 4, [&] {
    std::string bytes;
    Put(&bytes, place, 4);
    return bytes;
  }());
  for (const char* index : {"R03", "R98"}) {
    std::string directory;
    Put(&directory, 1, 2), Put(&directory, 1, 2), Put(&directory, 2, 2), Put(&directory, 4, 4);
    directory += std::string(index, 4);
    Put(&directory, 0, 4);
    const Image read = DecodeImage(
        WithJpegSegment(silent, 0xE1, std::string("Exif\0\0", 6) + block + directory), "a.jpg");
    const bool adobe = std::string(index) == "R03";
    EXPECT_EQ(std::abs(read.At(0, 8, 8) - 0.8f) < 0.015f, adobe) << index << read.At(0, 8, 8);
  }
}

TEST(SrgbConversion, KeepsSrgbBitForBit) {
  const Image srgb = Colors(3), gray = Colors(1);
  const Image plain = DecodeImage(EncodePng16(srgb), "a.png");
  EXPECT_EQ(DecodeImage(WithPngProfile(EncodePng16(srgb), SrgbProfile()), "a.png").data,
            plain.data);
  EXPECT_EQ(DecodeImage(WithPngProfile(EncodePng16(gray), SrgbGrayProfile()), "a.png").data,
            DecodeImage(EncodePng16(gray), "a.png").data);
}

TEST(SrgbConversion, KeepsAlphaAndLabels) {
  Image rgba = Colors(4);
  const std::string png = WithPngProfile(EncodePng16(rgba), ProPhotoProfile());
  const Image read = DecodeImage(png, "a.png", /*keep_alpha=*/true);
  ASSERT_EQ(read.channels, 4);
  for (size_t i = 0; i < read.PlaneSize(); ++i) {
    ASSERT_NEAR(read.Plane(3)[i], rgba.Plane(3)[i], 1e-5);
  }
  const ScratchFolder folder;
  const Image labels = Colors(1);
  WriteFileAtomic(folder.path() / "labels.png",
                  WithPngProfile(EncodePng16(labels), DotGainProfile(20.0)));
  EXPECT_LT(WorstDifference(ReadStoredValues(folder.path() / "labels.png"), labels), 1e-5);
}

TEST(SrgbConversion, IgnoresUselessProfilesWithNote) {
  const Image srgb = Colors(3);
  const Image plain = DecodeImage(EncodePng16(srgb), "a.png");
  const std::string adobe = AdobeRgbProfile();
  for (const std::string& profile : {std::string("no profile at all"),
                                     adobe.substr(0, 200),
                                     CmykProfile(),
                                     std::string(5 << 20, 'x')}) {
    const std::string png = WithPngProfile(EncodePng16(srgb), profile);
    EXPECT_EQ(DecodeImage(png, "a.png").data, plain.data);
    EXPECT_THAT(PictureNotes(png), ElementsAre(HasSubstr("is read as sRGB: its colour profile")));
  }
  const std::string jpeg = WithJpegProfile(UntaggedJpeg(srgb), adobe, 100);
  const std::string missing = std::string(jpeg).erase(2, 2 + 2 + 14 + 100);
  EXPECT_THAT(PictureNotes(missing), ElementsAre(HasSubstr("part 1 of")));
  EXPECT_NO_THROW(DecodeImage(missing, "a.jpg"));
}

TEST(SrgbConversion, DamagedProfilesNeverCrash) {
  Random random(4);
  const Image gray = Colors(1), rgb = Colors(3);
  for (const std::string& profile : {AdobeRgbProfile(), DotGainProfile(15.0), SrgbProfile()}) {
    for (int i = 0; i < 300; ++i) {
      std::string bytes = profile.substr(0, i % 3 == 0 ? random.NextBelow(700) : profile.size());
      for (int k = 0; k < 4 && !bytes.empty(); ++k) {
        bytes[random.NextBelow(static_cast<uint32_t>(bytes.size()))] ^=
            static_cast<char>(1u << random.NextBelow(8));
      }
      for (const Image& image : {gray, rgb}) {
        const Image read = DecodeImage(WithPngProfile(EncodePng8(image), bytes), "a.png");
        for (const float value : read.data) ASSERT_TRUE(value >= 0.0f && value <= 1.0f);
      }
    }
  }
}

TEST(SrgbConversion, WrittenFilesAreTaggedSrgb) {
  for (const int channels : {1, 3}) {
    const Image image = Colors(channels);
    EXPECT_TRUE(ReadColorTag(EncodePng8(image)).is_srgb);
    EXPECT_TRUE(ReadColorTag(EncodePng16(image)).is_srgb);
    const std::string jpeg = EncodeJpeg(image);
    EXPECT_EQ(ReadColorTag(jpeg).profile, channels == 1 ? SrgbGrayProfile() : SrgbProfile());
    EXPECT_EQ(jpeg, EncodeJpeg(image));
    EXPECT_THAT(PictureNotes(jpeg), IsEmpty());
  }
  EXPECT_LT(SrgbProfile().size(), 1000u);
}

}  // namespace
}  // namespace color3d
