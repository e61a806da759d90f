// Unary calls while one server stops and another replaces it.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include "client/lib/connection.h"
#include "client/lib/rpc_error.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace color3d::client {
namespace {
using ::testing::Each;
using ::testing::SizeIs;

grpc::Status StatusOf(grpc::StatusCode code, const char* reason) {
  google::rpc::ErrorInfo info;
  info.set_reason(reason);
  google::rpc::Status details;
  details.set_code(code);
  details.add_details()->PackFrom(info);
  return {code, reason, details.SerializeAsString()};
}

// Refuses a number of calls, then answers.
class EndingJobs final : public v1::JobService::Service {
 public:
  grpc::Status CreateJob(grpc::ServerContext*,
                         const v1::CreateJobRequest* request,
                         v1::Job* job) override {
    request_ids.push_back(request->request_id());
    if (refusals-- > 0) return refusal;
    job->set_name("jobs/1");
    return grpc::Status::OK;
  }
  int refusals = 0;
  grpc::Status refusal;
  std::vector<std::string> request_ids;
};

class DrainingTest : public ::testing::Test {
 protected:
  DrainingTest() {
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&jobs_);
    server_ = builder.BuildAndStart();
    connection_.emplace(ServerTarget{.address = "127.0.0.1:" + std::to_string(port)}, never_);
  }
  v1::Job Create() {
    v1::CreateJobRequest request;
    request.set_request_id("the same");
    return connection_->Call(&v1::JobService::Stub::CreateJob, connection_->jobs(), request);
  }

  const CancellationToken never_;
  EndingJobs jobs_;
  std::unique_ptr<grpc::Server> server_;
  std::optional<Connection> connection_;
};

TEST_F(DrainingTest, RetriesSameRequestWithNextServer) {
  jobs_.refusals = 2;
  jobs_.refusal = StatusOf(grpc::StatusCode::UNAVAILABLE, "DRAINING");
  EXPECT_EQ(Create().name(), "jobs/1");
  EXPECT_THAT(jobs_.request_ids, SizeIs(3));
  EXPECT_THAT(jobs_.request_ids, Each("the same"));
}

TEST_F(DrainingTest, DoesNotRetryPermanentErrors) {
  jobs_.refusals = 2;
  jobs_.refusal = StatusOf(grpc::StatusCode::FAILED_PRECONDITION, "INPUT_MISSING");
  try {
    Create();
    FAIL();
  } catch (const RpcError& e) {
    EXPECT_EQ(e.reason(), "INPUT_MISSING");
  }
  EXPECT_THAT(jobs_.request_ids, SizeIs(1));
}

}  // namespace
}  // namespace color3d::client
