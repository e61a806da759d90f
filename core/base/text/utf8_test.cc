#include "core/base/text/utf8.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(IsUtf8, FollowsRfc3629) {
  EXPECT_TRUE(IsUtf8(""));
  EXPECT_TRUE(IsUtf8("photo.jpg"));
  EXPECT_TRUE(IsUtf8("\xc3\xa9t\xc3\xa9.jpg"));
  EXPECT_TRUE(IsUtf8("\xe2\x82\xac"));
  EXPECT_TRUE(IsUtf8("\xf0\x9f\x93\xb7"));
  EXPECT_FALSE(IsUtf8("\xe9t\xe9.jpg"));     // Latin-1
  EXPECT_FALSE(IsUtf8("\xc0\xaf"));          // overlong
  EXPECT_FALSE(IsUtf8("\xe0\x80\xaf"));      // overlong
  EXPECT_FALSE(IsUtf8("\xed\xa0\x80"));      // surrogate
  EXPECT_FALSE(IsUtf8("\xf4\x90\x80\x80"));  // beyond U+10FFFF
  EXPECT_FALSE(IsUtf8("\xe2\x82"));          // cut short
}

TEST(CleanUtf8, ReplacesInvalidBytesOnly) {
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

TEST(EscapeControls, EscapesLineEndsAndTerminalCodes) {
  EXPECT_EQ(EscapeControls("plain \xc3\xa9 \xf0\x9f\x98\x80"), "plain \xc3\xa9 \xf0\x9f\x98\x80");
  EXPECT_EQ(EscapeControls("a\nb\rc\td"), "a\\nb\\rc\\td");
  EXPECT_EQ(EscapeControls("\x1b[2J\x7f"), "\\x1b[2J\\x7f");
  EXPECT_EQ(EscapeControls(std::string_view("\0", 1)), "\\x00");
  EXPECT_EQ(EscapeControls("\xc2\x9b"
                           "31m"),
            "\\u009b31m")
      << "CSI as one character";
  EXPECT_EQ(EscapeControls("\xe2\x80\xae"
                           "txt.exe"),
            "\\u202etxt.exe")
      << "right to left";
  EXPECT_EQ(EscapeControls("\xe2\x80\xa8"), "\\u2028") << "line separator";
  EXPECT_EQ(EscapeControls("\x9b"), "?") << "no UTF-8";
  EXPECT_EQ(EscapeControls("a\n\tb\r\x1b", Lines::kMany), "a\n\tb\\r\\x1b");
}

}  // namespace
}  // namespace color3d
