#include "server/access/tokens.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

class TokensTest : public testing::Test {
 protected:
  fs::path File() const { return scratch_.path() / "tokens"; }
  // Waits until a book checks the file again, after 1 s.
  static std::optional<TokenRecord> FindLater(TokenBook& book, const std::string& token) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));
    return book.Find(token);
  }

  ScratchFolder scratch_;
};

TEST_F(TokensTest, FindsAddedTokenWithRole) {
  const std::string anna = AddToken(File(), "anna", Role::kSubmit);
  const std::string bert = AddToken(File(), "bert@lab.org", Role::kRead);
  EXPECT_NE(anna, bert);
  EXPECT_EQ(anna.size(), 4u + 64u);
  EXPECT_EQ(ReadFile(File()).find(anna.substr(4)), std::string::npos)
      << "only its digest is stored";
  struct stat status {};
  ASSERT_EQ(::stat(File().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0600u);
  TokenBook book(File());
  ASSERT_TRUE(book.Find(anna));
  EXPECT_EQ(book.Find(anna)->name, "anna");
  EXPECT_EQ(book.Find(anna)->role, Role::kSubmit);
  EXPECT_EQ(book.Find(bert)->role, Role::kRead);
  EXPECT_FALSE(book.Find(anna.substr(1)));
  EXPECT_FALSE(book.Find(""));
  EXPECT_FALSE(book.Find(Sha256Hex(anna))) << "the digest is not a token";
}

TEST_F(TokensTest, ReloadsChangesAndIgnoresMistakes) {
  const std::string anna = AddToken(File(), "anna", Role::kSubmit);
  TokenBook book(File());
  const std::string bert = AddToken(File(), "bert", Role::kAdmin);
  EXPECT_TRUE(FindLater(book, bert));
  WriteFileAtomic(File(), "nonsense\n");
  ::chmod(File().c_str(), 0600);
  EXPECT_TRUE(FindLater(book, anna));
  fs::remove(File());
  EXPECT_TRUE(FindLater(book, anna));
  WriteFileAtomic(File(), "bert admin " + Sha256Hex(bert) + "\n");
  ::chmod(File().c_str(), 0600);
  EXPECT_FALSE(FindLater(book, anna)) << "the line was removed";
  EXPECT_TRUE(book.Find(bert));
}

TEST(RoleTest, IncludesTheOnesBeforeExceptWorkers) {
  EXPECT_TRUE(Includes(Role::kAdmin, Role::kRead));
  EXPECT_TRUE(Includes(Role::kSubmit, Role::kSubmit));
  EXPECT_FALSE(Includes(Role::kRead, Role::kSubmit));
  EXPECT_TRUE(Includes(Role::kWorker, Role::kWorker));
  for (const Role role : {Role::kRead, Role::kSubmit, Role::kAdmin}) {
    EXPECT_FALSE(Includes(Role::kWorker, role)) << RoleName(role);
    EXPECT_FALSE(Includes(role, Role::kWorker)) << RoleName(role);
    EXPECT_EQ(RoleFromName(RoleName(role)), role);
  }
}

TEST_F(TokensTest, NamesMistakesInFile) {
  const auto message = [](const std::string& text) {
    try {
      ParseTokens(text, "tokens");
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const std::string digest = Sha256Hex("x");
  EXPECT_EQ(ParseTokens("# users\n\nanna read " + digest + "\n", "tokens").size(), 1u);
  EXPECT_NE(message("anna read " + digest + "\nbert read 12\n").find("tokens, line 2"),
            std::string::npos);
  EXPECT_NE(message("anna king " + digest).find("read, submit, admin or worker"),
            std::string::npos);
  EXPECT_EQ(ParseTokens("anna read " + digest + " attic", "tokens").at(0).project, "attic");
  EXPECT_NE(message("anna read " + digest + " attic more").find("line 1"), std::string::npos);
  EXPECT_NE(message("anna read " + digest + " At@tic").find("is not a project name"),
            std::string::npos);
  EXPECT_NE(message("an/na read " + digest).find("line 1"), std::string::npos);
  const std::string token = AddToken(File(), "anna", Role::kRead, "cellar");
  EXPECT_EQ(TokenBook{File()}.Find(token)->project, "cellar");
  EXPECT_THROW(AddToken(File(), "anna", Role::kAdmin), Error);
  EXPECT_THROW(AddToken(File(), "gpu", Role::kWorker, "cellar"), Error) << "serves all projects";
  EXPECT_NE(message("gpu worker " + digest + " attic").find("line 1: the role worker has"),
            std::string::npos);
  EXPECT_THROW(AddToken(File(), "a b", Role::kAdmin), Error);
  ::chmod(File().c_str(), 0620);
  EXPECT_THROW(TokenBook{File()}, Error) << "writable by others";
  EXPECT_THROW(TokenBook{scratch_.path() / "none"}, Error);
}

TEST_F(TokensTest, FileKeepsOwnerPermissionsAndLink) {
  const fs::path real = scratch_.path() / "real", link = scratch_.path() / "link";
  AddToken(real, "anna", Role::kSubmit);
  ::chmod(real.c_str(), 0640);
  const bool is_root = ::geteuid() == 0;
  ASSERT_TRUE(!is_root || ::chown(real.c_str(), 1234, 1235) == 0);
  fs::create_symlink("real", link);
  AddToken(link, "bert", Role::kSubmit);
  struct stat status {};
  ASSERT_EQ(::lstat(real.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0640u);
  if (is_root) {
    EXPECT_EQ(status.st_uid, 1234u) << "the service must be able to read its tokens";
    EXPECT_EQ(status.st_gid, 1235u);
  }
  EXPECT_TRUE(fs::is_symlink(link)) << "the link was replaced by a file";
  EXPECT_EQ(ParseTokens(ReadFile(real), "real").size(), 2u);
}

TEST_F(TokensTest, ConcurrentAdditionsAreKept) {
  constexpr int kThreads = 8, kEach = 8;
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([this, i] {
      for (int k = 0; k < kEach; ++k) {
        AddToken(File(), "t" + std::to_string(i * kEach + k), Role::kRead);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(ParseTokens(ReadFile(File()), "tokens").size(), size_t{kThreads * kEach});
}

}  // namespace
}  // namespace color3d
