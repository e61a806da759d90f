#include "server/storage/data_folder.h"

#include <gtest/gtest.h>

#include "tests/support/service/storage_fixture.h"

namespace color3d {
namespace {

TEST(DataFolder, LocksOutSecondServer) {
  ScratchFolder scratch;
  const DataPaths paths(scratch.path() / "data");
  PrepareDataFolder(paths);
  {
    DataFolderLock lock(paths);
    EXPECT_EQ(ReasonThrown([&] { DataFolderLock second(paths); }), "FAILED_PRECONDITION");
  }
  DataFolderLock again(paths);
}

TEST(DataFolder, IsPrivateToOwner) {
  ScratchFolder scratch;
  const auto mode = [](const std::filesystem::path& path) {
    struct stat status {};
    EXPECT_EQ(::stat(path.c_str(), &status), 0);
    return status.st_mode & 0777u;
  };
  const DataPaths fresh(scratch.path() / "fresh");
  PrepareDataFolder(fresh);
  EXPECT_EQ(mode(fresh.root), 0700u);
  const DataPaths shared(scratch.path() / "shared");
  ASSERT_EQ(::mkdir(shared.root.c_str(), 0755), 0);
  ASSERT_EQ(::chmod(shared.root.c_str(), 0775), 0);
  PrepareDataFolder(shared);
  EXPECT_EQ(mode(shared.root), 0770u) << "a group that was let in stays";
}

TEST(DataFolder, ReportsUnusableFolder) {
  ScratchFolder scratch;
  WriteFileAtomic(scratch.path() / "file", "x");
  EXPECT_EQ(ReasonThrown([&] { PrepareDataFolder(DataPaths(scratch.path() / "file")); }),
            "FAILED_PRECONDITION");
}

}  // namespace
}  // namespace color3d
