#include "core/base/folder_walk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "core/base/error.h"
#include "core/base/files.h"
#include "tests/support/unprivileged.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class FolderWalkTest : private testing::Unprivileged, public ::testing::Test {
 protected:
  FolderWalkTest() {
    for (const char* folder : {"a", "b", "c"}) {
      fs::create_directory(scratch_.path() / folder);
      WriteFileAtomic(scratch_.path() / folder / "file", "x");
    }
    fs::permissions(scratch_.path() / "b", fs::perms::none);
  }
  ~FolderWalkTest() override { fs::permissions(scratch_.path() / "b", fs::perms::owner_all); }

  ScratchFolder scratch_;
};

TEST_F(FolderWalkTest, ReportsUnreadableEntriesAndVisitsOthers) {
  std::set<std::string> seen;
  const auto unreadable =
      WalkFolder(scratch_.path(), WalkDepth::kBelow, [&](const fs::directory_entry& entry) {
        seen.insert(entry.path().lexically_relative(scratch_.path()).string());
        return true;
      });
  EXPECT_THAT(seen, ElementsAre("a", "a/file", "b", "c", "c/file"));
  EXPECT_THAT(unreadable, ElementsAre(HasSubstr("/b: Permission denied")));
  EXPECT_THAT(
      WalkFolder(scratch_.path() / "none", WalkDepth::kFolder, [](const auto&) { return true; }),
      ElementsAre(HasSubstr("/none: No such file")));
}

TEST_F(FolderWalkTest, VisitorEndsWalk) {
  int visits = 0;
  const auto unreadable = WalkFolder(
      scratch_.path(), WalkDepth::kBelow, [&](const fs::directory_entry&) { return ++visits < 2; });
  EXPECT_EQ(visits, 2);
}

TEST_F(FolderWalkTest, UnreadableFolderIsNotEmpty) {
  try {
    ListFiles(scratch_.path());
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailedPrecondition);
    EXPECT_THAT(e.what(), HasSubstr("Permission denied"));
  }
  fs::permissions(scratch_.path() / "b", fs::perms::owner_all);
  EXPECT_THAT(ListFiles(scratch_.path()), ElementsAre("a/file", "b/file", "c/file"));
}

}  // namespace
}  // namespace color3d
