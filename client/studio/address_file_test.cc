#include "client/studio/address_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <optional>

#include "core/base/files.h"

namespace color3d::client {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

unsigned ModeOf(const fs::path& path) {
  struct stat facts {};
  return ::stat(path.c_str(), &facts) == 0 ? facts.st_mode & 0777 : 0;
}

TEST(AddressFileTest, OnlyItsOwnerReadsItAndItIsRemoved) {
  const ScratchFolder scratch;
  std::optional<AddressFile> file;
  file.emplace(scratch.path(), "http://127.0.0.1:1/open?token=ab&page=set/1\"><script>");
  const fs::path path = file->path();
  EXPECT_EQ(ModeOf(path), 0600u);
  EXPECT_THAT(path.string(), Not(HasSubstr("ab&")));
  const std::string html = ReadFile(path);
  EXPECT_THAT(html, HasSubstr("url=http://127.0.0.1:1/open?token=ab&amp;page=set/1&quot;>"));
  EXPECT_THAT(html, Not(HasSubstr("<script>")));
  file.emplace(scratch.path(), "http://127.0.0.1:1/");
  EXPECT_FALSE(fs::exists(path));
  file.reset();
  EXPECT_TRUE(fs::is_empty(scratch.path()));
}

TEST(AddressFileTest, FolderIsOneThatOthersCannotEnter) {
  const ScratchFolder scratch;
  const fs::path open = scratch.path() / "open", own = scratch.path() / "own",
                 otherwise = scratch.path() / "otherwise";
  fs::create_directories(open);
  fs::create_directories(own);
  fs::permissions(open, static_cast<fs::perms>(0755));
  fs::permissions(own, static_cast<fs::perms>(0700));
  const char* former = std::getenv("XDG_RUNTIME_DIR");
  const std::string kept = former == nullptr ? "" : former;
  ::setenv("XDG_RUNTIME_DIR", own.c_str(), 1);
  EXPECT_EQ(PrivateFolder(otherwise), own);
  ::setenv("XDG_RUNTIME_DIR", open.c_str(), 1);
  EXPECT_EQ(PrivateFolder(otherwise), otherwise);
  EXPECT_EQ(ModeOf(otherwise), 0700u);
  ::unsetenv("XDG_RUNTIME_DIR");
  EXPECT_EQ(PrivateFolder(otherwise), otherwise);
  if (former != nullptr) ::setenv("XDG_RUNTIME_DIR", kept.c_str(), 1);
}

TEST(AddressFileTest, MessageIsText) {
  const ScratchFolder scratch;
  const fs::path page = WriteMessagePage(scratch.path(), "a <b>\nc");
  EXPECT_THAT(ReadFile(page), HasSubstr("a &lt;b>\nc"));
  EXPECT_EQ(WriteMessagePage(scratch.path(), "again"), page);
}

}  // namespace
}  // namespace color3d::client
