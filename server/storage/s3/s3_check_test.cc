// What the server says at its start when the bucket cannot be used.
#include "server/storage/s3/s3_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/files.h"
#include "tests/support/service/s3_process.h"

namespace color3d {
namespace {
using ::testing::HasSubstr;
using testing::S3Process;

class S3CheckTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!S3Process::IsInstalled()) GTEST_SKIP() << "NOT TESTED: python3 is missing";
    server_ = std::make_unique<S3Process>(scratch_.path());
    options_ = server_->Options("p");
  }
  // The code, and the message.
  std::pair<ErrorCode, std::string> Problem() const {
    try {
      CheckBucket(options_);
    } catch (const Error& e) {
      return {e.code(), e.what()};
    }
    return {ErrorCode::kInternal, "none"};
  }
  void ExpectRefused(const char* problem, const char* remedy) const {
    const auto [code, message] = Problem();
    EXPECT_EQ(code, ErrorCode::kFailedPrecondition) << message;
    EXPECT_THAT(message, HasSubstr("s3://blobs/p"));
    EXPECT_THAT(message, HasSubstr(problem));
    EXPECT_THAT(message, HasSubstr(remedy));
  }

  ScratchFolder scratch_;
  std::unique_ptr<S3Process> server_;
  S3Options options_;
};

TEST_F(S3CheckTest, LeavesNothing) {
  CheckBucket(options_);
  EXPECT_TRUE(server_->Keys().empty());
}

TEST_F(S3CheckTest, NamesTheRemedy) {
  server_->Set(R"({"bucket": "others"})");
  ExpectRefused("NoSuchBucket", "create the bucket, or correct --blobs");
  server_->Set(R"({"bucket": "blobs", "denied": "^PUT "})");
  ExpectRefused("cannot write to", "s3:PutObject");
  server_->Set(R"({"denied": "^GET p/"})");
  ExpectRefused("cannot read from", "s3:GetObject");
  server_->Set(R"({"denied": "list-type"})");
  ExpectRefused("cannot list", "s3:ListBucket");
  server_->Set(R"({"denied": "^DELETE "})");
  ExpectRefused("cannot remove from", "s3:DeleteObject");
  server_->Set(R"({"denied": "", "id": "OTHER"})");
  ExpectRefused("InvalidAccessKeyId", "does not know access_key_id");
  server_->Set(R"({"id": "TESTKEY", "secret": "other"})");
  ExpectRefused("SignatureDoesNotMatch", "secret_access_key of --s3-credentials-file");
  server_->Set(R"({"secret": "test/secret+of=the/store", "region": "eu-west-2"})");
  ExpectRefused("AuthorizationHeaderMalformed", "give --s3-region eu-west-2");
  server_->Set(R"({"region": "us-east-1", "skew_seconds": 7200})");
  ExpectRefused("RequestTimeTooSkewed", "set the clock of this machine");
  EXPECT_THAT(Problem().second, HasSubstr("s behind the store's"));
  server_->Set(R"({"skew_seconds": 0, "stale": true})");
  ExpectRefused("does not show at once", "strongly consistent");
  server_->Set(R"({"stale": false})");
  EXPECT_EQ(Problem().second, "none");
}

TEST_F(S3CheckTest, StoreThatIsAwayMayComeBack) {
  server_->Fail("", 100, R"("kind": "status", "status": 503, "code": "ServiceUnavailable")");
  EXPECT_EQ(Problem().first, ErrorCode::kUnavailable);
  options_.target.host = "127.0.0.1:1";
  const auto [code, message] = Problem();
  EXPECT_EQ(code, ErrorCode::kUnavailable);
  EXPECT_THAT(message, HasSubstr("check --s3-endpoint http://127.0.0.1:1"));
  options_.target.host = "no-such-host.invalid";
  EXPECT_THAT(Problem().second, HasSubstr("http://no-such-host.invalid"));
}

TEST_F(S3CheckTest, BucketBelongsToOneStoreOfJobs) {
  ClaimBucket(options_, "folder 1");
  ClaimBucket(options_, "folder 1");
  try {
    ClaimBucket(options_, "folder 2");
    FAIL() << "another store of jobs";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailedPrecondition);
    EXPECT_THAT(e.what(), HasSubstr("(folder 1; this one is folder 2)"));
    EXPECT_THAT(e.what(), HasSubstr("remove the object 'p/owner'"));
  }
  ClaimBucket(server_->Options("q"), "folder 2");
}

}  // namespace
}  // namespace color3d
