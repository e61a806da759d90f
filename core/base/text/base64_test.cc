#include "core/base/text/base64.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(Base64Test, MatchesStandard) {
  EXPECT_EQ(Base64(""), "");
  EXPECT_EQ(Base64("f"), "Zg==");
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Base64(std::string("\xff\xfe\0", 3)), "//4A");
}

TEST(Base64Test, EncodesLargeInputInPieces) {
  const std::string text = Base64(std::string((size_t{3} << 24) + 4, 'o'));
  EXPECT_EQ(text.size(), (size_t{4} << 24) + 8);
  EXPECT_EQ(text.substr(text.size() - 12), "b29vb29vbw==");
  EXPECT_EQ(text.find('='), text.size() - 2);
}

}  // namespace
}  // namespace color3d
