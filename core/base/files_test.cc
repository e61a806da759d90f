#include "core/base/files.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

TEST(Files, WritesAtomically) {
  ScratchFolder scratch;
  const fs::path path = scratch.path() / "value.bin";
  WriteFileAtomic(path, "one");
  WriteFileAtomic(path, std::string("two\0three", 9));
  EXPECT_EQ(ReadFile(path), std::string("two\0three", 9));
  EXPECT_EQ(DigestFile(path).sha256, Sha256Hex(std::string("two\0three", 9)));
  EXPECT_EQ(ListFiles(scratch.path()), std::vector<std::string>{"value.bin"});
}

TEST(Files, ReplacedFileKeepsModeAndOwner) {
  ScratchFolder scratch;
  const fs::path path = scratch.path() / "file";
  WriteFileAtomic(path, "one");
  for (const mode_t mode : {0600, 0640, 0664}) {
    ASSERT_EQ(::chmod(path.c_str(), mode), 0);
    const bool is_root = ::geteuid() == 0;
    ASSERT_TRUE(!is_root || ::chown(path.c_str(), 1234, 1235) == 0);
    WriteFileAtomic(path, "two");
    struct stat status {};
    ASSERT_EQ(::stat(path.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777u, mode);
    EXPECT_TRUE(!is_root || status.st_uid == 1234u);
    EXPECT_TRUE(!is_root || status.st_gid == 1235u);
  }
}

TEST(Files, ErrorsNamePathAndLeaveNoFile) {
  ScratchFolder scratch;
  try {
    WriteFileAtomic(scratch.path() / "missing" / "x", "y");
    FAIL() << "wrote into a folder that does not exist";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kNotFound);
    EXPECT_NE(std::string(e.what()).find("missing"), std::string::npos);
  }
  EXPECT_THROW(ReadFile(scratch.path() / "absent"), Error);
  EXPECT_THROW(ReadFile(scratch.path()), Error);
  EXPECT_TRUE(ListFiles(scratch.path()).empty());
}

TEST(Files, RecognizesUnsafePaths) {
  for (const char* good : {"a.jpg", "images/a b.jpg", "x/..y/z"}) {
    EXPECT_TRUE(IsSafeRelativePath(good)) << good;
  }
  for (const char* bad : {"", "/etc/passwd", "../a", "a/../b", "a//b", "a/.", "a\\b", "a/\n"}) {
    EXPECT_FALSE(IsSafeRelativePath(bad)) << bad;
  }
}

}  // namespace
}  // namespace color3d
