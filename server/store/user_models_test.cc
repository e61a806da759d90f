#include "server/store/user_models.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string ParseError(const std::vector<std::string>& models,
                       const std::vector<std::string>& backends = {}) {
  try {
    ParseUserModels(models, backends);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    return e.what();
  }
  return "";
}

TEST(UserModels, ParsesFlagsAndPassesThemOn) {
  const UserModels models =
      ParseUserModels({"clip=/m/a=b.pt", "ddcolor-1.0=/m/d"}, {"uni=127.0.0.1:7"});
  EXPECT_EQ(models.files.at("clip"), "/m/a=b.pt");
  EXPECT_EQ(NamesOf(models.files), "clip, ddcolor-1.0");
  EXPECT_THAT(ToFlags(models),
              ElementsAre("--model",
                          "clip=/m/a=b.pt",
                          "--model",
                          "ddcolor-1.0=/m/d",
                          "--backend",
                          "uni=127.0.0.1:7"));
  EXPECT_TRUE(ParseUserModels({"a=relative"}, {}).files.at("a").is_absolute());
}

TEST(UserModels, RefusesBadAndRepeatedNames) {
  EXPECT_THAT(ParseError({"clip"}), HasSubstr("is not NAME=FILE"));
  EXPECT_THAT(ParseError({"clip="}), HasSubstr("is not NAME=FILE"));
  EXPECT_THAT(ParseError({"=x"}), HasSubstr("the name ''"));
  EXPECT_THAT(ParseError({"Clip=x"}), HasSubstr("the name 'Clip'"));
  EXPECT_THAT(ParseError({"../a=x"}), HasSubstr("the name '../a'"));
  EXPECT_THAT(ParseError({std::string(65, 'a') + "=x"}), HasSubstr("1 to 64"));
  EXPECT_THAT(ParseError({"a=x", "a=y"}), HasSubstr("given twice"));
  EXPECT_THAT(ParseError({}, {"a=x", "a=x"}), HasSubstr("--backend a is given twice"));
}

TEST(UserModels, NamesMissingFile) {
  const ScratchFolder folder;
  WriteFileAtomic(folder.path() / "there", "x");
  const std::string there = "a=" + (folder.path() / "there").string();
  EXPECT_NO_THROW(RequireReadable(ParseUserModels({there}, {})));
  try {
    RequireReadable(ParseUserModels({there, "b=" + folder.path().string()}, {}));
    FAIL() << "a folder is no weight file";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kNotFound);
    EXPECT_THAT(e.what(), AllOf(HasSubstr("--model b="), HasSubstr("no such file")));
  }
}

TEST(UserModels, ReplacedFileHasNewDigest) {
  const ScratchFolder folder;
  const auto file = folder.path() / "w";
  WriteFileAtomic(file, "one");
  FileDigests digests;
  EXPECT_EQ(digests.Of(file).sha256, Sha256Hex("one"));
  const std::string before = FileIdentity(file);
  WriteFileAtomic(file, "two");  // as long as the first, within the same second
  EXPECT_EQ(digests.Of(file).sha256, Sha256Hex("two"));
  EXPECT_NE(FileIdentity(file), before);
  EXPECT_THROW(digests.Of(folder.path() / "none"), Error);
}

TEST(UserModels, RecognisesKinds) {
  const ScratchFolder folder;
  const auto kind = [&](const std::string& bytes) {
    WriteFileAtomic(folder.path() / "w", bytes);
    return GuessModelKind(folder.path() / "w");
  };
  EXPECT_EQ(kind("........{\"visual.conv1.weight\":"), "clip");
  EXPECT_EQ(kind("........{\"encoder.arch.norm0.weight\":"), "ddcolor");
  EXPECT_EQ(kind("........{\"downsample_layers.0.0.weight\":"), "convnext");
  EXPECT_EQ(kind("PK" + std::string(5 << 20, 'x') + "model/code/__torch__.py"), "torchscript");
  EXPECT_EQ(kind(""), "unknown");
}

}  // namespace
}  // namespace color3d
