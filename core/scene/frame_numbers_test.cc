#include "core/scene/frame_numbers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace color3d {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(FrameNumbers, GapsKeepTheirTime) {
  const FrameNumbers one =
      FramePositions({"shot_0007.png", "shot_0008.png", "shot_0009.png", "shot_0013.png"});
  EXPECT_THAT(one.places, ElementsAre(0, 1, 2, 6));
  EXPECT_THAT(one.note, HasSubstr("3 frames are missing between shot_0009.png and shot_0013.png:"));
  const FrameNumbers two = FramePositions({"1.tif", "2.tif", "4.tif", "5.tif", "6.tif", "8.tif"});
  EXPECT_THAT(two.places, ElementsAre(0, 1, 3, 4, 5, 7));
  EXPECT_THAT(two.note,
              HasSubstr("2 frames are missing between 2.tif and 4.tif, and in one more place:"));
}

TEST(FrameNumbers, EveryTenthFrameLeavesNoGap) {
  EXPECT_THAT(FramePositions({"f000.png", "f010.png", "f020.png", "f030.png"}).note, IsEmpty());
  const FrameNumbers gap = FramePositions({"f000.png", "f010.png", "f020.png", "f040.png"});
  EXPECT_THAT(gap.places, ElementsAre(0, 1, 2, 4));
  EXPECT_THAT(gap.note, HasSubstr("1 frame is missing between f020.png and f040.png"));
}

TEST(FrameNumbers, FindsNumberAnywhereInName) {
  EXPECT_THAT(
      FramePositions({"r2/a1_v3.png", "r2/a2_v3.png", "r2/a3_v3.png", "r2/a5_v3.png"}).places,
      ElementsAre(0, 1, 2, 4));
  EXPECT_THAT(FramePositions({"9.jp2", "10.jp2", "11.jp2", "13.jp2"}).places,
              ElementsAre(0, 1, 2, 4));
}

TEST(FrameNumbers, NamesWithoutOneNumberAreConsecutive) {
  for (const std::vector<std::string>& names :
       {std::vector<std::string>{"a.png", "b.png", "d.png", "e.png"},
        {"a1.png", "a2.png", "b3.png", "b9.png"},
        {"2024-01-01.png", "2024-01-02.png", "2024-02-01.png", "2024-02-02.png"},
        {"1.jpg", "1.png", "2.png", "5.png"},
        {"1.png", "01.png", "2.png", "5.png"},
        {"100.png", "133.png", "201.png", "290.png"},
        {"1.png", "99999999999999999999999.png", "199999999999999999999999.png", "2.png"},
        {"1.png", "9.png"}}) {
    const FrameNumbers numbers = FramePositions(names);
    EXPECT_EQ(numbers.places.back(), static_cast<int64_t>(names.size()) - 1) << names.back();
    EXPECT_THAT(numbers.note, IsEmpty());
  }
}

TEST(FrameNumbers, LargeJumpIsNoGap) {
  const FrameNumbers numbers = FramePositions({"0001.png", "0002.png", "0003.png", "9001.png"});
  EXPECT_THAT(numbers.places, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(numbers.note,
              AllOf(HasSubstr("8997 frames are missing"), HasSubstr("without a gap")));
}

}  // namespace
}  // namespace color3d
