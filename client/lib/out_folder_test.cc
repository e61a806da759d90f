#include "client/lib/out_folder.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d::client {
namespace {
namespace fs = std::filesystem;

class OutFolderTest : public testing::Test {
 protected:
  OutFolderTest() {
    fs::create_directory(out_);
    fs::create_directory(elsewhere_);
  }
  // What SafePathBelow throws for the name; empty when it throws nothing.
  std::string Refusal(const std::string& name) {
    try {
      SafePathBelow(out_, name);
      return "";
    } catch (const Error& e) {
      return e.what();
    }
  }

  const ScratchFolder scratch_;
  const fs::path out_ = scratch_.path() / "out", elsewhere_ = scratch_.path() / "elsewhere";
};

TEST_F(OutFolderTest, CreatesFolders) {
  EXPECT_EQ(SafePathBelow(out_, "a/b/c.png"), out_ / "a/b/c.png");
  EXPECT_TRUE(fs::is_directory(out_ / "a/b"));
  EXPECT_EQ(SafePathBelow(out_, "a/b/d.png"), out_ / "a/b/d.png");
}

TEST_F(OutFolderTest, RefusesNamesThatLeaveFolder) {
  for (const std::string name : {"../x", "/etc/x", "a/../../x", "", "a//b", "a\nb", "a/."}) {
    EXPECT_NE(Refusal(name).find("not safe"), std::string::npos) << name;
  }
  EXPECT_TRUE(fs::is_empty(out_));
}

TEST_F(OutFolderTest, RefusesLinkBelowFolder) {
  fs::create_directory_symlink(elsewhere_, out_ / "renders");
  EXPECT_NE(Refusal("renders/deep/a.png").find("renders is a symbolic link"), std::string::npos);
  EXPECT_TRUE(fs::is_empty(elsewhere_));
  fs::create_directory_symlink(scratch_.path() / "nowhere", out_ / "dangling");
  EXPECT_NE(Refusal("dangling/a.png").find("is a symbolic link"), std::string::npos);
  WriteFileAtomic(out_ / "file", "x");
  EXPECT_NE(Refusal("file/a.png").find("is a file where"), std::string::npos);
}

TEST_F(OutFolderTest, FolderItselfMayBeLink) {
  fs::create_directory_symlink(elsewhere_, scratch_.path() / "link");
  EXPECT_EQ(SafePathBelow(scratch_.path() / "link", "a/b"), scratch_.path() / "link/a/b");
  EXPECT_TRUE(fs::is_directory(elsewhere_ / "a"));
}

TEST_F(OutFolderTest, RemovesLinksAndKeepsPlainFiles) {
  WriteFileAtomic(elsewhere_ / "precious", "mine");
  fs::create_symlink(elsewhere_ / "precious", out_ / "soft");
  fs::create_hard_link(elsewhere_ / "precious", out_ / "hard");
  WriteFileAtomic(out_ / "plain", "ours");
  for (const char* name : {"soft", "hard", "plain", "absent"}) RemoveUnlessPlainFile(out_ / name);
  EXPECT_FALSE(fs::exists(fs::symlink_status(out_ / "soft")));
  EXPECT_FALSE(fs::exists(out_ / "hard"));
  EXPECT_EQ(ReadFile(out_ / "plain"), "ours");
  EXPECT_EQ(ReadFile(elsewhere_ / "precious"), "mine");
}

}  // namespace
}  // namespace color3d::client
