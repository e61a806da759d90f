#include "client/options/key_color_flags.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"

namespace color3d::client {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

class KeyColorFlagsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    WriteFileAtomic(Path("a.png"), EncodePng8(Image(4, 3, 3, 0.5f)));
    WriteFileAtomic(Path("p.json"), R"([{"x": 1, "y": 1, "color": "#ff0000"}])");
  }
  std::string Path(const std::string& name) const { return (folder_.path() / name).string(); }

  // Returns the error message of a command line, or an empty string.
  std::string Complaint(std::vector<std::string> arguments) {
    for (std::string& argument : arguments) {
      if (argument == "PNG") argument = Path("a.png");
      if (argument == "JSON") argument = Path("p.json");
    }
    std::reverse(arguments.begin(), arguments.end());
    CLI::App app;
    flags_ = {};
    DeclareKeyColorFlags(app, &flags_);
    try {
      app.parse(arguments);
      flags_.Check();
    } catch (const std::exception& e) {
      return e.what();
    }
    return "";
  }

  const ScratchFolder folder_;
  KeyColorFlags flags_;
};

TEST_F(KeyColorFlagsTest, AcceptsEachSource) {
  for (const std::vector<std::string>& line : {std::vector<std::string>{"--auto"},
                                               {"--auto", "--model", "ddcolor"},
                                               {"--key-color", "PNG"},
                                               {"--image", "PNG"},
                                               {"--hints", "PNG"},
                                               {"--points", "JSON", "--labels", "PNG"},
                                               {"--auto", "--hints", "JSON"},
                                               {"--key-color", "PNG", "--points", "JSON"},
                                               {"--reference", "PNG", "--hints", "JSON"},
                                               {"--reference", "PNG", "--reference", "PNG"},
                                               {"--prompt", "red brick", "--model", "clip"},
                                               {"--edit", "PNG", "--mask", "PNG"},
                                               {"--script", "mine"},
                                               {"--backend",
                                                "b",
                                                "--prompt",
                                                "red",
                                                "--points",
                                                "JSON",
                                                "--reference",
                                                "PNG",
                                                "--mask",
                                                "PNG"}}) {
    EXPECT_EQ(Complaint(line), "") << line[0];
    EXPECT_TRUE(flags_.HasSource()) << line[0];
  }
  EXPECT_EQ(Complaint({}), "");
  EXPECT_FALSE(flags_.HasSource());
}

TEST_F(KeyColorFlagsTest, RefusesTwoSources) {
  EXPECT_THAT(Complaint({"--auto", "--key-color", "PNG"}),
              AllOf(HasSubstr("--key-color and --auto"), HasSubstr("one source")));
  EXPECT_THAT(Complaint({"--backend", "b", "--auto"}), HasSubstr("--backend and --auto"));
  EXPECT_THAT(Complaint({"--prompt", "red", "--model", "clip", "--reference", "PNG"}),
              HasSubstr("--reference and --prompt"));
}

TEST_F(KeyColorFlagsTest, NamesRequiredFlag) {
  EXPECT_THAT(Complaint({"--prompt", "red"}), HasSubstr("--model NAME"));
  EXPECT_THAT(Complaint({"--key-color", "PNG", "--model", "x"}), HasSubstr("omit it"));
  EXPECT_THAT(Complaint({"--backend", "b", "--model", "x"}), HasSubstr("omit it"));
  EXPECT_THAT(Complaint({"--auto", "--mask", "PNG"}), HasSubstr("--edit or --backend"));
  EXPECT_THAT(Complaint({"--hints", "PNG", "--labels", "PNG"}), HasSubstr(".json"));
  EXPECT_THAT(Complaint({"--mask", "PNG"}), HasSubstr("--edit or --backend"));
  EXPECT_THAT(Complaint({"--backend", "b", "--hints", "PNG"}), HasSubstr(".json"));
  EXPECT_THAT(Complaint({"--auto", "--hints", "PNG"}),
              AllOf(HasSubstr("above the colours of another source"), HasSubstr(".json")));
  EXPECT_THAT(Complaint({"--backend", "b", "--reference", "PNG", "--reference", "PNG"}),
              HasSubstr("one --reference, not 2"));
}

TEST_F(KeyColorFlagsTest, NamesUnreadableFiles) {
  EXPECT_THAT(Complaint({"--edit", Path("none.png")}),
              AllOf(HasSubstr("--edit"), HasSubstr("none.png")));
  EXPECT_THAT(Complaint({"--reference", "JSON"}), HasSubstr("is not an image"));
  WriteFileAtomic(Path("bad.json"), "nonsense");
  EXPECT_THAT(Complaint({"--hints", Path("bad.json")}), HasSubstr("not a JSON list"));
}

}  // namespace
}  // namespace color3d::client
