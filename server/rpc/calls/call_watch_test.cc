#include "server/rpc/calls/call_watch.h"

#include <gtest/gtest.h>

#include <mutex>

#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {

TEST(CallWatchTest, ParseTraceIdRejectsMalformedTraceParents) {
  const std::string trace = "4bf92f3577b34da6a3ce929d0e0e4736", rest = "-00f067aa0ba902b7-01";
  EXPECT_EQ(ParseTraceId("00-" + trace + rest), trace);
  EXPECT_EQ(ParseTraceId("cc-" + trace + rest + "-later-fields"), trace);
  for (const std::string& bad : {std::string(),
                                 "00-" + trace + rest + "-more",
                                 "ff-" + trace + rest,
                                 "00-" + std::string(32, '0') + rest,
                                 "00-" + trace + "-0000000000000000-01",
                                 "00-4BF92F3577B34DA6A3CE929D0E0E4736" + rest,
                                 "00_" + trace + rest,
                                 "00-" + trace,
                                 std::string(55, '-')}) {
    EXPECT_EQ(ParseTraceId(bad), "") << bad;
  }
}

class CallsTest : public RpcTest {
 protected:
  CallsTest() {
    RpcServerOptions options;
    options.listen = "127.0.0.1:0";
    options.on_call = [this](const std::string& method, grpc::StatusCode code, double seconds) {
      std::lock_guard lock(mutex_);
      ++ended_[method + " " + std::to_string(code)];
      EXPECT_GE(seconds, 0.0);
    };
    watched_ = std::make_unique<RpcServer>(options, store_, blobs_, uploads_, SystemClock());
    caller_ = std::make_unique<TestClient>(watched_->address());
  }
  int Ended(const std::string& call) {
    for (int i = 0; i < 200; ++i) {
      {
        std::lock_guard lock(mutex_);
        if (ended_.contains(call)) return ended_[call];
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return 0;
  }
  std::string RequestIdFor(const std::string& mine) {
    grpc::ClientContext context;
    if (!mine.empty()) context.AddMetadata("x-request-id", mine);
    v1::ServerInfo info;
    caller_->server->GetServerInfo(&context, {}, &info);
    const auto id = context.GetServerTrailingMetadata().find("x-request-id");
    return id == context.GetServerTrailingMetadata().end()
               ? ""
               : std::string(id->second.data(), id->second.size());
  }

  std::mutex mutex_;
  std::map<std::string, int> ended_;
  std::unique_ptr<RpcServer> watched_;
  std::unique_ptr<TestClient> caller_;
};

TEST_F(CallsTest, EachCallHasId) {
  EXPECT_EQ(RequestIdFor("mine-1"), "mine-1");
  EXPECT_EQ(RequestIdFor("not [sane]=1").size(), 16u);
  const std::string one = RequestIdFor(""), other = RequestIdFor("");
  EXPECT_EQ(one.size(), 16u);
  EXPECT_NE(one, other);
}

TEST_F(CallsTest, CountsCallsByStatus) {
  RequestIdFor("");
  EXPECT_EQ(Ended("/color3d.v1.ServerService/GetServerInfo 0"), 1);
  EXPECT_THROW(caller_->Get("jobs/none"), std::runtime_error);
  EXPECT_EQ(Ended("/color3d.v1.JobService/GetJob 5"), 1);
  caller_->Upload("bytes");
  EXPECT_EQ(Ended("/google.bytestream.ByteStream/Write 0"), 1);
  grpc::ClientContext context;
  const v1::Job job = client_->Create(ScriptedSpec(client_->MakeScene().name(), "a"));
  v1::WatchJobsRequest watch;
  watch.add_names(job.name());
  auto stream = caller_->jobs->WatchJobs(&context, watch);
  v1::JobEvent event;
  EXPECT_TRUE(stream->Read(&event));
  EXPECT_EQ(watched_->open().watches, 1);
  context.TryCancel();
  stream->Finish();
  EXPECT_EQ(Ended("/color3d.v1.JobService/WatchJobs 1"), 1);
}

TEST_F(CallsTest, JobKeepsTraceOfItsCall) {
  const std::string trace = "4bf92f3577b34da6a3ce929d0e0e4736";
  grpc::ClientContext context;
  context.AddMetadata("traceparent", "00-" + trace + "-00f067aa0ba902b7-01");
  v1::CreateJobRequest request;
  *request.mutable_spec() = ScriptedSpec(client_->MakeScene().name(), "a");
  v1::Job job;
  ASSERT_TRUE(caller_->jobs->CreateJob(&context, request, &job).ok());
  EXPECT_EQ(store_.GetJob(job.name()).trace, trace);
  EXPECT_EQ(store_.ListChildren(job.name()).at(0).trace, trace);
}

}  // namespace
}  // namespace color3d::testing
