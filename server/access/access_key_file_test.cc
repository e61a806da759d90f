#include "server/access/access_key_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {
using ::testing::HasSubstr;
using ::testing::Not;

std::string ProblemOf(const std::string& text) {
  try {
    ParseAccessKey(text, "the file");
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(AccessKeyFileTest, ReadsKeysInEitherForm) {
  const AccessKey plain = ParseAccessKey("access_key_id=A1\nsecret_access_key = s/+=\n", "f");
  EXPECT_EQ(plain.id, "A1");
  EXPECT_EQ(plain.secret, "s/+=");
  EXPECT_EQ(plain.session_token, "");
  const AccessKey amazon = ParseAccessKey(
      "# of the archive\n[default]\r\naws_access_key_id = A1\r\naws_secret_access_key = s\r\n"
      "aws_session_token = t\r\n",
      "f");
  EXPECT_EQ(amazon.id, "A1");
  EXPECT_EQ(amazon.session_token, "t");
}

TEST(AccessKeyFileTest, NamesLineOfFaultAndNotTheSecret) {
  EXPECT_THAT(ProblemOf(""), HasSubstr("the file has no line access_key_id"));
  EXPECT_THAT(ProblemOf("access_key_id = A1\n"), HasSubstr("no line secret_access_key"));
  EXPECT_THAT(ProblemOf("access_key_id = A1\nhunter2\n"), HasSubstr("the file, line 2: expected"));
  EXPECT_THAT(ProblemOf("[a]\n[b]\n"), HasSubstr("line 2: a second section"));
  for (const char* text : {"access_key_id = A1\nhunter2\n",
                           "hunter2 = x\n",
                           "secret_access_key = hunter2 x\n",
                           "secret_access_key = hunter2\n"}) {
    EXPECT_THAT(ProblemOf(text), Not(HasSubstr("hunter2"))) << text;
    EXPECT_NE(ProblemOf(text), "") << text;
  }
}

TEST(AccessKeyFileTest, RefusesFileThatOthersMayRead) {
  const ScratchFolder scratch;
  const std::filesystem::path file = scratch.path() / "key";
  WriteFileAtomic(file, "access_key_id = A1\nsecret_access_key = s\n");
  for (const mode_t mode : {0640, 0604, 0660}) {
    ASSERT_EQ(::chmod(file.c_str(), mode), 0);
    try {
      AccessKeyFile key(file);
      FAIL() << "mode " << mode;
    } catch (const Error& e) {
      EXPECT_THAT(e.what(), HasSubstr("run chmod 600 " + file.string()));
    }
  }
  ASSERT_EQ(::chmod(file.c_str(), 0600), 0);
  EXPECT_EQ(AccessKeyFile(file).Latest().id, "A1");
}

}  // namespace
}  // namespace color3d
