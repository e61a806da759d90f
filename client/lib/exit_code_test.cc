#include "client/lib/exit_code.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/lib/rpc_error.h"
#include "google/rpc/error_details.pb.h"

namespace color3d::client {
namespace {

TEST(ExitCode, MapsErrors) {
  EXPECT_EQ(ExitCodeOf(ErrorCode::kInvalidArgument), ExitCode::kBadInput);
  EXPECT_EQ(ExitCodeOf(ErrorCode::kFailedPrecondition), ExitCode::kBadInput);
  EXPECT_EQ(ExitCodeOf(ErrorCode::kNotFound), ExitCode::kBadInput);
  EXPECT_EQ(ExitCodeOf(ErrorCode::kUnimplemented), ExitCode::kBadInput);
  EXPECT_EQ(ExitCodeOf(ErrorCode::kUnavailable), ExitCode::kUnreachable);
  EXPECT_EQ(ExitCodeOf(ErrorCode::kDeadlineExceeded), ExitCode::kUnreachable);
  EXPECT_EQ(ExitCodeOf(ErrorCode::kResourceExhausted), ExitCode::kNoRoom);
  EXPECT_EQ(ExitCodeOf(ErrorCode::kInternal), ExitCode::kJobFailed);
  EXPECT_EQ(ExitCodeOf(ErrorCode::kCancelled), ExitCode::kDetached);
  EXPECT_EQ(static_cast<int>(ExitCode::kDetached), 130);
}

TEST(ExitCode, MapsJobs) {
  v1::Job job;
  job.set_state(v1::Job::STATE_SUCCEEDED);
  EXPECT_EQ(ExitCodeOf(job), ExitCode::kOk);
  job.set_state(v1::Job::STATE_CANCELLED);
  EXPECT_EQ(ExitCodeOf(job), ExitCode::kJobFailed);
  job.set_state(v1::Job::STATE_FAILED);
  job.mutable_error()->set_code(grpc::StatusCode::INTERNAL);
  EXPECT_EQ(ExitCodeOf(job), ExitCode::kJobFailed);
  job.mutable_error()->set_code(grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(ExitCodeOf(job), ExitCode::kBadInput);
  job.mutable_error()->set_code(grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ExitCodeOf(job), ExitCode::kBadInput);
}

grpc::Status DetailedStatus(grpc::StatusCode code, const std::string& reason) {
  google::rpc::Status details;
  google::rpc::ErrorInfo info;
  info.set_reason(reason);
  details.add_details()->PackFrom(info);
  google::rpc::BadRequest bad;
  auto* violation = bad.add_field_violations();
  violation->set_field("images/a.jpg");
  violation->set_description("is truncated");
  details.add_details()->PackFrom(bad);
  return {code, "the message", details.SerializeAsString()};
}

TEST(RpcError, ReadsDetails) {
  const RpcError error(DetailedStatus(grpc::StatusCode::INVALID_ARGUMENT, "SCENE_INVALID"));
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  EXPECT_STREQ(error.what(), "the message");
  EXPECT_EQ(error.reason(), "SCENE_INVALID");
  ASSERT_EQ(error.violations().size(), 1u);
  EXPECT_EQ(error.violations()[0].field, "images/a.jpg");
  EXPECT_EQ(error.violations()[0].description, "is truncated");
}

TEST(RpcError, IdentifiesTransientErrors) {
  const RpcError broken(grpc::Status(grpc::StatusCode::UNAVAILABLE, "failed to connect"));
  EXPECT_TRUE(broken.IsTransient());
  EXPECT_TRUE(broken.IsUnreachable());
  const RpcError overloaded(DetailedStatus(grpc::StatusCode::UNAVAILABLE, "OVERLOADED"));
  EXPECT_TRUE(overloaded.IsTransient());
  EXPECT_FALSE(overloaded.IsUnreachable());
  const RpcError draining(DetailedStatus(grpc::StatusCode::UNAVAILABLE, "DRAINING"));
  EXPECT_TRUE(draining.IsTransient()) << "it may be back soon, with the same jobs";
  const RpcError wrong(grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "x", "not a status"));
  EXPECT_FALSE(wrong.IsTransient());
  EXPECT_EQ(wrong.reason(), "");
}

}  // namespace
}  // namespace color3d::client
