#include "server/storage/data_folder.h"

#include <gtest/gtest.h>

#include "tests/support/service/storage_fixture.h"

namespace color3d {
namespace {

TEST(DataFolder, SecondServerIsKeptOut) {
  ScratchFolder scratch;
  const DataPaths paths(scratch.path() / "data");
  PrepareDataFolder(paths);
  {
    DataFolderLock lock(paths);
    EXPECT_EQ(ReasonThrown([&] { DataFolderLock second(paths); }), "FAILED_PRECONDITION");
  }
  DataFolderLock again(paths);
}

TEST(DataFolder, UnusableFolderIsReported) {
  ScratchFolder scratch;
  WriteFileAtomic(scratch.path() / "file", "x");
  EXPECT_EQ(ReasonThrown([&] { PrepareDataFolder(DataPaths(scratch.path() / "file")); }),
            "FAILED_PRECONDITION");
}

}  // namespace
}  // namespace color3d
