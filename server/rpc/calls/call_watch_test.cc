#include "server/rpc/calls/call_watch.h"

#include <grpcpp/impl/client_unary_call.h>
#include <gtest/gtest.h>

#include <mutex>

#include "tests/support/service/received_spans.h"
#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {

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
  const std::string expected = "00-" + trace + "-00f067aa0ba902b7-01";
  EXPECT_EQ(store_.GetJob(job.name()).trace, expected);
  EXPECT_EQ(store_.ListChildren(job.name()).at(0).trace, expected);
}

// A server that exports traces.
class TracedCallsTest : public CallsTest {
 protected:
  TracedCallsTest() { Serve({}); }
  void Serve(const TraceSampler& sampler) {
    TraceSettings settings;
    settings.target.url = collector_.url();
    settings.service = "color3d-server";
    settings.sampler = sampler;
    tracer_ = Tracer::Make(settings, "1", [](const std::string&) {});
    RpcServerOptions options;
    options.listen = "127.0.0.1:0";
    options.tracer = tracer_;
    traced_ = std::make_unique<RpcServer>(options, store_, blobs_, uploads_, SystemClock());
    caller_ = std::make_unique<TestClient>(traced_->address());
  }
  // Returns the traceparent of the job that this call creates.
  std::string CreateWith(const std::string& traceparent) {
    grpc::ClientContext context;
    if (!traceparent.empty()) context.AddMetadata("traceparent", traceparent);
    v1::CreateJobRequest request;
    *request.mutable_spec() = ScriptedSpec(client_->MakeScene().name(), "a");
    v1::Job job;
    EXPECT_TRUE(caller_->jobs->CreateJob(&context, request, &job).ok());
    return store_.GetJob(job.name()).trace;
  }
  std::vector<ReceivedSpan> Spans() {
    EXPECT_TRUE(tracer_->Flush(std::chrono::seconds(10)));
    return SpansOf(collector_);
  }

  const std::string trace_ = "4bf92f3577b34da6a3ce929d0e0e4736";
  const std::string sampled_ = "00-" + trace_ + "-00f067aa0ba902b7-01";
  const std::string not_sampled_ = "00-" + trace_ + "-00f067aa0ba902b7-00";
  HttpReceiver collector_{{"200 OK"}};
  std::shared_ptr<Tracer> tracer_;
  std::unique_ptr<RpcServer> traced_;
};

TEST_F(TracedCallsTest, JobIsPartOfTheSpanOfItsCall) {
  const std::string traceparent = CreateWith(sampled_);
  const std::vector<ReceivedSpan> spans = Spans();
  ASSERT_EQ(spans.size(), 1u);
  EXPECT_EQ(spans[0].name, "color3d.v1.JobService/CreateJob");
  EXPECT_EQ(spans[0].trace, trace_);
  EXPECT_EQ(spans[0].parent, "00f067aa0ba902b7");
  EXPECT_EQ(spans[0].kind, 2);
  EXPECT_EQ(spans[0].error, "");
  EXPECT_EQ(spans[0].attributes.at("rpc.system"), "grpc");
  EXPECT_EQ(spans[0].attributes.at("rpc.service"), "color3d.v1.JobService");
  EXPECT_EQ(spans[0].attributes.at("rpc.method"), "CreateJob");
  EXPECT_EQ(spans[0].attributes.at("rpc.grpc.status_code"), "0");
  EXPECT_EQ(traceparent, "00-" + trace_ + "-" + spans[0].id + "-01");
}

TEST_F(TracedCallsTest, CallerWithoutTraceBeginsOne) {
  const std::string traceparent = CreateWith("");
  const std::string other = CreateWith("not a traceparent");
  const std::vector<ReceivedSpan> spans = Spans();
  ASSERT_EQ(spans.size(), 2u);
  EXPECT_EQ(spans[0].parent, "");
  EXPECT_EQ(traceparent, "00-" + spans[0].trace + "-" + spans[0].id + "-01");
  EXPECT_EQ(other, "00-" + spans[1].trace + "-" + spans[1].id + "-01");
  EXPECT_NE(spans[0].trace, spans[1].trace);
}

TEST_F(TracedCallsTest, SamplerDecides) {
  EXPECT_EQ(CreateWith(not_sampled_), not_sampled_);
  EXPECT_TRUE(Spans().empty());
  Serve({/*ratio=*/0.0, /*follows_parent=*/false});
  EXPECT_EQ(CreateWith(sampled_), not_sampled_);
  EXPECT_EQ(CreateWith(""), "");
  EXPECT_TRUE(Spans().empty());
}

TEST_F(TracedCallsTest, FailuresHaveTheirCodeAndHealthChecksNoSpan) {
  EXPECT_THROW(caller_->Get("jobs/none"), std::runtime_error);
  grpc::ClientContext context;
  context.AddMetadata("traceparent", sampled_);
  const grpc::Slice nothing;
  const grpc::ByteBuffer empty(&nothing, 1);
  grpc::ByteBuffer answer;
  const grpc::internal::RpcMethod health("/grpc.health.v1.Health/Check",
                                         grpc::internal::RpcMethod::NORMAL_RPC);
  EXPECT_TRUE(
      grpc::internal::BlockingUnaryCall(caller_->channel.get(), health, &context, empty, &answer)
          .ok());
  const std::vector<ReceivedSpan> spans = Spans();
  ASSERT_EQ(spans.size(), 1u);
  EXPECT_EQ(spans[0].attributes.at("rpc.grpc.status_code"), "5");
  EXPECT_EQ(spans[0].error, "") << "a fault of the caller";
}

}  // namespace
}  // namespace color3d::testing
