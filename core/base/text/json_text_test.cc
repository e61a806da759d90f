#include "core/base/text/json_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/base/error.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

std::string Plain(std::string_view text) {
  std::string plain;
  for (PlainJson at(text), end; at != end; ++at) plain += *at;
  return plain;
}

std::string Said(std::string_view text) {
  try {
    ParseJson(text, "a.json");
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(JsonText, KeepsValidJson) {
  for (const char* text : {"",
                           " \n",
                           "{}",
                           "[1, 2]",
                           R"({"a,": [1, -2.5e3, true, null, "NaN, ]", "\\", "\",]"], "b": {}})",
                           "[1,,2]",
                           "[,1]",
                           R"(["open)",
                           R"(["\)",
                           "[1e-400]"}) {
    EXPECT_EQ(Plain(text), text);
  }
}

TEST(JsonText, AcceptsJsonOfOtherPrograms) {
  EXPECT_EQ(Plain("\xef\xbb\xbf{}"), "{}");
  EXPECT_EQ(Plain("[1,\n]"), "[1\n]");
  EXPECT_EQ(Plain("{\"a\": 1 , }"), "{\"a\": 1  }");
  EXPECT_EQ(Plain("[NaN,-Infinity,Infinity,nan]"), R"(["NaN","-Infinity","Infinity","nan"])");
  EXPECT_EQ(Plain("NaN"), "\"NaN\"");
  EXPECT_EQ(Plain("[1e999, 1e9]"), "[\"1e999\", 1e9]");
  EXPECT_EQ(Plain("[[NaN,],],"), "[[\"NaN\"]],");
}

TEST(JsonText, ErrorsNameFileAndLine) {
  EXPECT_EQ(Said("{\"a\": NaN, \"b\": [1, 2,], }"), "");
  EXPECT_THAT(Said("{\n\"a\": 1\n\"b\": 2}"),
              HasSubstr("a.json is not JSON: parse error at line 3"));
  EXPECT_THAT(Said("[Nope]"), HasSubstr("a.json is not JSON: parse error at line 1"));
  EXPECT_EQ(Said("[\x01]").find('\x01'), std::string::npos);
  EXPECT_THAT(Said("{\n\"frames\": [\n"), HasSubstr("line 3"));
  EXPECT_EQ(Said(std::string_view("\xff\xfe{\0}\0", 6)), "a.json is UTF-16 text; save it as UTF-8");
}

TEST(JsonText, SkipsByteOrderMark) {
  EXPECT_EQ(WithoutMark("\xef\xbb\xbf# a", "a.txt"), "# a");
  EXPECT_EQ(WithoutMark("# a", "a.txt"), "# a");
  EXPECT_THROW(WithoutMark("\xfe\xff", "a.txt"), Error);
}

}  // namespace
}  // namespace color3d
