#include "client/options/credit_flags.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"

namespace color3d::client {
namespace {
using ::testing::Contains;
using ::testing::IsEmpty;
using ::testing::Pair;

Image Plain() { return Image(200, 100, 3, 0.5f); }

TEST(CreditFlagsTest, AreParsed) {
  CLI::App app;
  CreditFlags flags;
  DeclareCreditFlags(app, &flags, /*with_caption=*/true);
  EXPECT_FALSE(flags.IsGiven());
  app.parse("--colored-by 'A B' --key-view-by C --source D --licence 'CC BY' --caption");
  EXPECT_TRUE(flags.IsGiven());
  EXPECT_EQ(CreditText(flags.credit),
            "Coloured by A B. Key view by C. Original: D. Licence: CC BY. Colours are inferred.");
}

TEST(CreditFlagsTest, PicturesInColorGetIt) {
  EXPECT_TRUE(IsColoredPicture("key_view_colored.png"));
  EXPECT_TRUE(IsColoredPicture("key_views/1/key_view_colored.png"));
  EXPECT_TRUE(IsColoredPicture("renders/a.png"));
  EXPECT_TRUE(IsColoredPicture("film_frames/a.png"));
  for (const char* other : {"key_view.png", "key_color.png", "key_view_ranking.jpg", "view.html"}) {
    EXPECT_FALSE(IsColoredPicture(other)) << other;
  }
  const ScratchFolder scratch;
  CreditFlags flags;
  flags.credit.licence = "CC0";
  for (const char* name : {"key_view_colored.png", "key_view.png"}) {
    WriteFileAtomic(scratch.path() / name, EncodePng8(Plain()));
  }
  CreditPictures(scratch.path(), {"key_view_colored.png", "key_view.png", "scene.ply"}, flags);
  EXPECT_THAT(ReadPictureTexts(ReadFile(scratch.path() / "key_view_colored.png"), "a"),
              Contains(Pair("Copyright", "CC0")));
  EXPECT_THAT(ReadPictureTexts(ReadFile(scratch.path() / "key_view.png"), "a"), IsEmpty());
}

TEST(CreditFlagsTest, CaptionMakesPicturesTaller) {
  CreditFlags flags;
  flags.credit.colored_by = "A";
  flags.caption = true;
  for (const auto& [name, picture] :
       {std::pair("a.png", EncodePng8(Plain())), std::pair("a.jpg", EncodeJpeg(Plain()))}) {
    const std::string credited = WithCredit(picture, flags, name);
    EXPECT_GT(ProbeImage(credited, name).height, 100) << name;
    EXPECT_FALSE(ReadPictureTexts(credited, name).empty());
  }
}

}  // namespace
}  // namespace color3d::client
