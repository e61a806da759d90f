#include "server/worker/told_paths.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(ToldPaths, KeepOnlyNamesInScene) {
  const auto told = [](const char* message) {
    return WithoutFolders(message, {"/data/scratch/JOB-1/scene", "/data/scratch/JOB-1", "/data"});
  };
  EXPECT_EQ(told("cannot read /data/scratch/JOB-1/scene/images/a.jpg: Input/output error"),
            "cannot read images/a.jpg: Input/output error");
  EXPECT_EQ(told("/data/scratch/JOB-1/tmp/x and /data/blobs/ab/cd"), "tmp/x and blobs/ab/cd");
  EXPECT_EQ(told("nothing to see in /database"), "nothing to see in /database");
}

}  // namespace
}  // namespace color3d
