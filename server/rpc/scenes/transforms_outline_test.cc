#include "server/rpc/scenes/transforms_outline.h"

#include <gtest/gtest.h>

#include <string>

#include "core/base/memory.h"

namespace color3d {
namespace {

TEST(TransformsOutline, CountsFrames) {
  EXPECT_EQ(
      OutlineOfTransforms(R"({"w": 1, "frames": [{"a": [1]}, {"frames": [1, 2]}, 3]})").frames, 3);
  EXPECT_EQ(OutlineOfTransforms(R"({"a": {"frames": [1, 2]}})").frames, 0);
  EXPECT_EQ(OutlineOfTransforms(R"({"frames": {"a": 1, "b": 2}})").frames, 0);
  EXPECT_EQ(OutlineOfTransforms(R"({"frames": [1, 2], "frames": [1]})").frames, 1);
  EXPECT_EQ(OutlineOfTransforms(R"({"frames": [1, 2], "frames": 7})").frames, 0);
  EXPECT_TRUE(OutlineOfTransforms("{}").is_object);
}

TEST(TransformsOutline, WhatIsNoObjectIsSaid) {
  for (const char* text : {"", "[1, 2]", "7", "{", R"({"frames": [1, 2)", "{]", "\xff\xfe"}) {
    EXPECT_FALSE(OutlineOfTransforms(text).is_object) << text;
    EXPECT_EQ(OutlineOfTransforms(text).frames, 0) << text;
  }
}

TEST(TransformsOutline, WhatIsNotWellFormedIsNamedByLine) {
  EXPECT_NE(OutlineOfTransforms("{\n\"frames\": [1 2]}").error.find("line 2"), std::string::npos);
  EXPECT_EQ(OutlineOfTransforms("[1]").error, "");
}

TEST(TransformsOutline, WhatOtherProgramsWriteIsRead) {
  const TransformsOutline outline =
      OutlineOfTransforms("\xef\xbb\xbf{\"frames\": [{\"a\": NaN,}, {\"a\": -Infinity},],}");
  EXPECT_TRUE(outline.is_object);
  EXPECT_EQ(outline.frames, 2);
}

TEST(TransformsOutline, MemoryDoesNotGrowWithTheFile) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "most of the memory is ThreadSanitizer's";
#endif
  std::string text = "{\"frames\": [";
  for (int i = 0; i < 3'000'000; ++i) text += "[1,2],";
  text += "0]}";
  ResetPeakMemory();
  const int64_t before = PeakMemoryBytes();
  EXPECT_EQ(OutlineOfTransforms(text).frames, 3'000'001);
  EXPECT_LT(PeakMemoryBytes() - before, int64_t{16} << 20);
}

}  // namespace
}  // namespace color3d
