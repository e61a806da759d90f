#include "core/image/credit/picture_credit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/image/credit/caption.h"

namespace color3d {
namespace {
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

PictureCredit Sample() {
  return {.colored_by = "Jürgen \"J\" <Müller>",
          .key_view_by = "Zoë & Søn",
          .source = "Stadtarchiv Köln, Best. 1234",
          .licence = "CC BY 4.0",
          .software = "Color3D 1.2"};
}

Image Ramp() {
  Image image(160, 90, 3);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<float>(i % 251) / 250;
  return image;
}

std::map<std::string, std::string> TextsOf(const std::string& file) {
  const auto texts = ReadPictureTexts(file, "a");
  return {texts.begin(), texts.end()};
}

// What ImageMagick reads, with its names of fields.
std::string Identify(const std::string& file, const std::string& ending, const std::string& what) {
  const ScratchFolder scratch;
  const auto path = scratch.path() / ("a" + ending);
  WriteFileAtomic(path, file);
  const auto out = scratch.path() / "out";
  const std::string command = "identify -format '" + what + "' '" + path.string() + "' > '" +
                              out.string() + "' 2>/dev/null";
  return std::system(command.c_str()) == 0 ? ReadFile(out) : "";
}

TEST(PictureCreditTest, TextNamesPeopleSourceAndLicence) {
  EXPECT_EQ(CreditText(Sample()),
            "Coloured by Jürgen \"J\" <Müller>. Key view by Zoë & Søn. Original: Stadtarchiv Köln, "
            "Best. 1234. Licence: CC BY 4.0. Colours are inferred.");
  EXPECT_EQ(CreditText({}), "Colours are inferred.");
  EXPECT_TRUE(PictureCredit().IsEmpty());
  EXPECT_FALSE(Sample().IsEmpty());
}

TEST(PictureCreditTest, PngHoldsTextsAndXmp) {
  const std::string plain = EncodePng8(Ramp());
  const std::string file = AddCredit(plain, Sample(), "a.png");
  const auto texts = TextsOf(file);
  EXPECT_EQ(texts.at("Description"), CreditText(Sample()));
  EXPECT_EQ(texts.at("Copyright"), "CC BY 4.0");
  EXPECT_EQ(texts.at("Source"), "Stadtarchiv Köln, Best. 1234");
  EXPECT_EQ(texts.at("Software"), "Color3D 1.2");
  EXPECT_EQ(texts.at("Disclaimer"), "Colours are inferred.");
  EXPECT_THAT(texts.at("XMP"),
              AllOf(HasSubstr("<rdf:li>Jürgen &quot;J&quot; &lt;Müller&gt; (colours)</rdf:li>"),
                    HasSubstr("<rdf:li>Zoë &amp; Søn (colours of the key view)</rdf:li>"),
                    HasSubstr("digitalsourcetype/algorithmicallyEnhanced")));
  EXPECT_EQ(DecodeImage(file, "a.png").data, DecodeImage(plain, "a.png").data);
  ProbeImage(file, "a.png");  // checks the sums of the chunks
}

TEST(PictureCreditTest, JpegHoldsXmpAndIptc) {
  const std::string plain = EncodeJpeg(Ramp());
  const std::string file = AddCredit(plain, Sample(), "a.jpg");
  const auto texts = TextsOf(file);
  EXPECT_EQ(texts.at("1:90"), "\x1b%G");
  EXPECT_EQ(texts.at("2:120"), CreditText(Sample()));
  EXPECT_EQ(texts.at("2:116"), "CC BY 4.0");
  EXPECT_EQ(texts.at("2:115"), "Stadtarchiv Köln, Best. 1234");
  EXPECT_EQ(texts.at("2:40"), "Colours are inferred.");
  EXPECT_THAT(texts.at("XMP"), HasSubstr("Colours are inferred."));
  EXPECT_EQ(DecodeImage(file, "a.jpg").data, DecodeImage(plain, "a.jpg").data);
}

TEST(PictureCreditTest, OtherProgramsReadIt) {
  const std::string jpeg = AddCredit(EncodeJpeg(Ramp()), Sample(), "a");
  const std::string caption = Identify(jpeg, ".jpg", "%[IPTC:2:120]");
  if (caption.empty()) GTEST_SKIP() << "skipped, because there is no ImageMagick";
  EXPECT_EQ(caption, CreditText(Sample()));
  EXPECT_EQ(Identify(jpeg, ".jpg", "%[IPTC:2:116]"), "CC BY 4.0");
}

TEST(PictureCreditTest, ReplacesAnEarlierOne) {
  PictureCredit other;
  other.colored_by = "Somebody else";
  for (const std::string& plain : {EncodePng8(Ramp()), EncodeJpeg(Ramp())}) {
    const std::string once = AddCredit(plain, Sample(), "a");
    EXPECT_EQ(AddCredit(AddCredit(plain, other, "a"), Sample(), "a"), once);
    EXPECT_THAT(AddCredit(once, other, "a"), Not(HasSubstr("CC BY")));
  }
}

TEST(PictureCreditTest, RefusesOtherAndDamagedFiles) {
  EXPECT_THROW(AddCredit("text", Sample(), "a.txt"), Error);
  for (const std::string& plain : {EncodePng8(Ramp()), EncodeJpeg(Ramp())}) {
    // A JPEG that ends among its pixels keeps its head.
    for (const size_t bytes : {size_t{3}, size_t{12}, size_t{19}}) {
      EXPECT_THROW(AddCredit(plain.substr(0, bytes), Sample(), "a"), Error) << bytes;
      EXPECT_THROW(ReadPictureTexts(plain.substr(0, bytes), "a"), Error) << bytes;
    }
  }
  PictureCredit broken;
  broken.licence = "a\nb";
  EXPECT_THROW(broken.Validate(), Error);
  broken.licence = std::string(501, 'a');
  EXPECT_THROW(broken.Validate(), Error);
  broken.licence = "\xff";
  EXPECT_THROW(broken.Validate(), Error);
}

TEST(CaptionTest, StandsBelowThePicture) {
  const Image picture = Ramp();
  const Image whole = WithCaption(picture, CreditText(Sample()));
  EXPECT_EQ(whole.width, picture.width);
  ASSERT_GT(whole.height, picture.height + 20);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      ASSERT_NEAR(whole.At(1, y, x), picture.At(1, y, x), 1e-6f);
    }
  }
  float darkest = 1.0f;
  for (int y = picture.height; y < whole.height; ++y) {
    for (int x = 0; x < whole.width; ++x) darkest = std::min(darkest, whole.At(0, y, x));
  }
  EXPECT_LT(darkest, 0.4f) << "letters";
  EXPECT_GT(WithCaption(picture, CreditText(Sample()) + " More.").height, picture.height);
}

TEST(CaptionTest, WritesLatinLettersAndNamesOthers) {
  const Image picture(200, 100, 1, 0.5f);
  EXPECT_EQ(WithCaption(picture, "Müller, Zoë").data, WithCaption(picture, "Mueller, Zoe").data);
  EXPECT_EQ(WithCaption(picture, "ſ").data, WithCaption(picture, "s").data);
  try {
    WithCaption(picture, "写真");
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("写"));
  }
  EXPECT_THROW(WithCaption(Image(20, 20, 1), "a"), Error);
}

}  // namespace
}  // namespace color3d
