#include "server/rpc/utf8.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(CleanUtf8, KeepsValidTextAndReplacesTheRest) {
  EXPECT_EQ(CleanUtf8("plain"), "plain");
  EXPECT_EQ(CleanUtf8("stra\xc3\x9f"
                      "e \xe2\x82\xac \xf0\x9f\x98\x80"),
            "stra\xc3\x9f"
            "e \xe2\x82\xac \xf0\x9f\x98\x80");
  EXPECT_EQ(CleanUtf8("a\xff"
                      "b"),
            "a?b");
  EXPECT_EQ(CleanUtf8("\xc3"), "?") << "cut short";
  EXPECT_EQ(CleanUtf8("\xc0\xaf"), "??") << "overlong";
  EXPECT_EQ(CleanUtf8("\xed\xa0\x80"), "???") << "surrogate";
  EXPECT_EQ(CleanUtf8("\xf5\x80\x80\x80"), "????") << "beyond U+10FFFF";
}

TEST(CleanUtf8, CutsBetweenCharacters) {
  EXPECT_EQ(CleanUtf8("abc", 2), "ab");
  EXPECT_EQ(CleanUtf8("a\xe2\x82\xac", 3), "a");
  EXPECT_EQ(CleanUtf8("a\xe2\x82\xac", 4), "a\xe2\x82\xac");
}

}  // namespace
}  // namespace color3d
