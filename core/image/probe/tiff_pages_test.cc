#include "core/image/probe/tiff_pages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/image/codec.h"
#include "core/image/probe/orientation.h"
#include "core/image/probe/probe.h"
#include "tests/support/formats/picture_files.h"

namespace color3d {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Image Plain(int width, int height, float value, int channels = 1) {
  return Image(width, height, channels, value);
}

// Expects the page of 40 x 30 px of value 0.8.
void ExpectThePicture(const std::string& tiff, const std::string& what) {
  const ImageInfo info = ProbeImage(tiff, "scan.tif");
  EXPECT_EQ(info.width, 40) << what;
  EXPECT_EQ(info.height, 30) << what;
  const Image image = DecodeImage(tiff, "scan.tif");
  ASSERT_EQ(image.width, 40) << what;
  EXPECT_NEAR(image.At(0, 15, 20), 0.8, 0.003) << what;
}

TEST(TiffPagesTest, ReadsLargestPage) {
  for (const bool big_endian : {false, true}) {
    for (const int bits : {8, 16}) {
      const TiffPageToWrite picture{.image = Plain(40, 30, 0.8f), .bits = bits};
      const TiffPageToWrite preview{.image = Plain(10, 8, 0.2f), .subfile_type = 1};
      const TiffPageToWrite unsaid{.image = Plain(10, 8, 0.2f)};
      TiffPageToWrite both_reduced = picture;
      both_reduced.subfile_type = 1;
      TiffPageToWrite above = preview, below = picture;
      above.sub_directories = {preview, picture};
      below.sub_directories = {preview};
      const std::vector<std::vector<TiffPageToWrite>> files = {{preview, picture},
                                                               {picture, preview},
                                                               {unsaid, picture, unsaid},
                                                               {preview, both_reduced},
                                                               {above},
                                                               {below}};
      for (size_t i = 0; i < files.size(); ++i) {
        const std::string tiff = TiffFile(files[i], big_endian);
        ExpectThePicture(tiff, "file " + std::to_string(i));
        EXPECT_THAT(PictureNotes(tiff),
                    ElementsAre(HasSubstr("pages; the largest is read (40 x 30 px)")));
      }
    }
  }
}

TEST(TiffPagesTest, SkipsMasksAndNotesSeveralPagesOnly) {
  const TiffPageToWrite picture{.image = Plain(40, 30, 0.8f)};
  const TiffPageToWrite mask{.image = Plain(80, 60, 1.0f), .subfile_type = 4, .photometric = 1};
  const std::string tiff = TiffFile({mask, picture});
  ExpectThePicture(tiff, "mask");
  EXPECT_THAT(PictureNotes(tiff), IsEmpty());
}

TEST(TiffPagesTest, ReadsFirstOfEqualPagesWithNote) {
  const std::string tiff = TiffFile({{.image = Plain(40, 30, 0.8f)},
                                     {.image = Plain(40, 30, 0.1f)},
                                     {.image = Plain(40, 30, 0)}});
  ExpectThePicture(tiff, "equal");
  EXPECT_THAT(PictureNotes(tiff), ElementsAre(HasSubstr("has 3 pages of 40 x 30 px; the first")));
}

TEST(TiffPagesTest, UsesOrientationAndProfileOfPage) {
  const TiffPageToWrite preview{.image = Plain(10, 8, 0.2f), .orientation = 3};
  TiffPageToWrite picture{.image = Plain(40, 30, 0.5f), .orientation = 6};
  picture.profile = GrayGammaProfile(1.0);
  const std::string tiff = TiffFile({preview, picture});
  EXPECT_EQ(ReadOrientation(tiff), 6);
  const Image image = DecodeImage(tiff, "scan.tif");
  EXPECT_EQ(image.width, 30);
  EXPECT_EQ(image.height, 40);
  EXPECT_NEAR(image.At(0, 9, 9), 0.735, 0.01);  // light of a half
}

TEST(TiffPagesTest, CyclesAndBadPointersEndPageList) {
  const TiffPageToWrite page{.image = Plain(40, 30, 0.8f)};
  std::string tiff = TiffFile({page, page});
  const TiffPages pages = ListTiffPages(tiff);
  ASSERT_EQ(pages.pages.size(), 2u);
  const auto first = static_cast<char>(pages.pages[0].directory & 255u);
  const auto second_byte = static_cast<char>(pages.pages[0].directory >> 8 & 255u);
  // The last four bytes of the file are the offset of the page after the second one.
  std::string cycle = tiff;
  cycle[cycle.size() - 4] = first;
  cycle[cycle.size() - 3] = second_byte;
  EXPECT_EQ(ListTiffPages(cycle).pages.size(), 2u);
  ExpectThePicture(cycle, "cycle");
  std::string nowhere = tiff;
  nowhere.replace(nowhere.size() - 4, 4, "\x7F\x7F\x7F\x7F");
  ExpectThePicture(nowhere, "nowhere");
}

TEST(TiffPagesTest, RejectsRawAndCmykWithRemedy) {
  const auto refusal = [](const std::string& tiff) -> std::string {
    try {
      DecodeImage(tiff, "a.tif");
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  // The preview before a sensor's data is not the picture.
  EXPECT_THAT(refusal(TiffFile({{.image = Plain(10, 8, 0.2f)},
                                {.image = Plain(40, 30, 0.8f), .photometric = 32803}})),
              HasSubstr("a.tif holds a camera's raw data; develop it"));
  EXPECT_THAT(refusal(TiffFile({{.image = Plain(10, 8, 0.2f, 4), .photometric = 5}})),
              HasSubstr("a.tif is in CMYK"));
}

}  // namespace
}  // namespace color3d
