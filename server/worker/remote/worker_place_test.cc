#include "server/worker/remote/worker_place.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <ctime>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using std::chrono::duration_cast;
using std::chrono::seconds;
using std::chrono::steady_clock;

TEST(WorkerPlaceTest, FolderIsPrivateAndHeldByOneWorker) {
  const ScratchFolder scratch;
  const DataPaths paths(scratch.path() / "cache");
  {
    const WorkerFolder first(paths);
    struct stat status {};
    ASSERT_EQ(::stat(paths.root.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777u, 0700u);
    EXPECT_THROW(WorkerFolder{paths}, Error);
    fs::create_directories(paths.Scratch() / "left over" / "deep");
  }
  const WorkerFolder next(paths);
  EXPECT_TRUE(fs::is_empty(paths.Scratch()));
}

TEST(WorkerPlaceTest, TokenIsTheOnlyWord) {
  const ScratchFolder scratch;
  const fs::path file = scratch.path() / "token";
  WriteFileAtomic(file, "  c3d_1234\n");
  EXPECT_EQ(ReadToken(file), "c3d_1234");
  for (const char* wrong : {"", " \n", "two words"}) {
    WriteFileAtomic(file, wrong);
    EXPECT_THROW(ReadToken(file), Error) << wrong;
  }
}

TEST(WorkerPlaceTest, UntilIsATimeOrSeconds) {
  const auto left = [](const std::string& text) {
    return duration_cast<seconds>(ParseUntil(text) - steady_clock::now()).count();
  };
  EXPECT_NEAR(static_cast<double>(left("3600")), 3600.0, 5.0);
  EXPECT_LT(left("2020-01-31T18:00:00Z"), -86'400);
  const std::time_t in_an_hour = std::time(nullptr) + 3600;
  char text[32];
  std::strftime(text, sizeof(text), "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&in_an_hour));
  EXPECT_NEAR(static_cast<double>(left(text)), 3600.0, 5.0);
  for (const char* wrong : {"", "tomorrow", "-5", "10m", "2026-01-31"}) {
    EXPECT_THROW(ParseUntil(wrong), Error) << wrong;
  }
}

}  // namespace
}  // namespace color3d
