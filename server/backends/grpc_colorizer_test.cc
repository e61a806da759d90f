// Client of model servers, against servers that misbehave.
#include "server/backends/grpc_colorizer.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <thread>

#include "color3d/backend/v1/backend.grpc.pb.h"
#include "server/backends/backend_prober.h"

namespace color3d {
namespace {
using std::chrono::milliseconds;
using ::testing::AllOf;
using ::testing::HasSubstr;
using SteadyClock = std::chrono::steady_clock;
using Writer = grpc::ServerWriter<backend::v1::ColorizeUpdate>;

backend::v1::ColorizeUpdate Picture(const std::string& bytes) {
  backend::v1::ColorizeUpdate update;
  update.set_image(bytes);
  return update;
}
backend::v1::ColorizeUpdate Share(double progress) {
  backend::v1::ColorizeUpdate update;
  update.set_progress(progress);
  return update;
}

class FakeBackend : public backend::v1::ColorBackend::Service {
 public:
  grpc::Status GetInfo(grpc::ServerContext*,
                       const backend::v1::GetInfoRequest*,
                       backend::v1::BackendInfo* info) override {
    ++info_calls;
    info->set_name("fake\nbackend");
    info->set_version("2");
    info->set_license("MIT");
    info->set_max_pixels(1'000'000);
    info->add_capabilities(backend::v1::CAPABILITY_AUTOMATIC);
    info->add_capabilities(backend::v1::CAPABILITY_MASK);
    info->add_capabilities(static_cast<backend::v1::Capability>(77));
    info->set_ready(info_calls >= ready_after);
    return grpc::Status::OK;
  }
  grpc::Status Colorize(grpc::ServerContext* context,
                        const backend::v1::ColorizeRequest* request,
                        Writer* writer) override {
    ++calls;
    key = request->idempotency_key();
    const auto parent = context->client_metadata().find("traceparent");
    if (parent != context->client_metadata().end()) {
      traceparent.assign(parent->second.data(), parent->second.size());
    }
    return behave(context, writer);
  }
  grpc::Status Generate(grpc::ServerContext*,
                        const backend::v1::GenerateRequest* request,
                        grpc::ServerWriter<backend::v1::GenerateUpdate>* writer) override {
    generate_kind = request->kind();
    for (int i = 0; i < pictures; ++i) {
      backend::v1::GenerateUpdate update;
      update.set_progress(0.1);
      writer->Write(update);
      update.set_image(picture);
      writer->Write(update);
    }
    return grpc::Status::OK;
  }

  int pictures = 2;
  std::string picture = "png";
  std::atomic<int> generate_kind{0};
  std::atomic<int> info_calls{0};
  std::atomic<int> calls{0};
  int ready_after = 1;
  std::string key, traceparent;
  std::function<grpc::Status(grpc::ServerContext*, Writer*)> behave = [](grpc::ServerContext*,
                                                                         Writer* writer) {
    writer->Write(Share(0.25));
    writer->Write(Share(0.5));
    writer->Write(Picture("png"));
    return grpc::Status::OK;
  };
};

class ProgressLog : public NullObserver {
 public:
  void OnProgress(int64_t step, int64_t, const std::string&) override { steps.push_back(step); }
  std::vector<int64_t> steps;
};

class GrpcColorizerTest : public ::testing::Test {
 protected:
  GrpcColorizerTest() {
    options_.deadline = milliseconds(5'000);
    options_.ready_patience = milliseconds(1'000);
    options_.ready_poll = milliseconds(20);
    options_.first_backoff = milliseconds(20);
    options_.max_message_bytes = 1 << 20;
  }
  void Start() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort(
        "127.0.0.1:" + std::to_string(port_), grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(&backend_);
    server_ = builder.BuildAndStart();
    ASSERT_NE(server_, nullptr);
  }
  void TearDown() override {
    if (server_) server_->Shutdown(std::chrono::system_clock::now());
  }
  std::string Address() const { return "127.0.0.1:" + std::to_string(port_); }
  std::unique_ptr<RemoteColorizer> Remote() {
    return MakeGrpcColorizer("fake", Address(), options_);
  }
  std::string Colorize() {
    RemoteRequest request;
    request.idempotency_key = "jobs/1/1";
    request.image_png = "grey";
    return Remote()->Colorize(request, progress_, cancel_);
  }
  std::string Complaint(const std::function<void()>& call) {
    try {
      call();
    } catch (const Error& e) {
      code_ = e.code();
      return e.what();
    }
    return "";
  }

  FakeBackend backend_;
  std::unique_ptr<grpc::Server> server_;
  int port_ = 0;
  GrpcColorizerOptions options_;
  ProgressLog progress_;
  CancellationToken cancel_;
  ErrorCode code_ = ErrorCode::kInternal;
};

TEST_F(GrpcColorizerTest, SendsRequestAndReturnsAnswer) {
  Start();
  const RemoteInfo info = Remote()->GetInfo(progress_, cancel_);
  EXPECT_EQ(info.description, "fake?backend 2 (MIT)");
  EXPECT_EQ(info.capabilities, (std::set<std::string>{"automatic", "mask"}));
  EXPECT_EQ(info.max_pixels, 1'000'000);
  EXPECT_EQ(Colorize(), "png");
  EXPECT_EQ(backend_.key, "jobs/1/1");
  EXPECT_EQ(progress_.steps, (std::vector<int64_t>{250, 500}));
}

TEST_F(GrpcColorizerTest, RetriesDeadBackendThenNamesRemedy) {
  Start();
  server_->Shutdown();
  server_.reset();
  const std::string complaint = Complaint([&] { Remote()->GetInfo(progress_, cancel_); });
  EXPECT_EQ(code_, ErrorCode::kUnavailable);
  EXPECT_THAT(complaint, AllOf(HasSubstr("'fake'"), HasSubstr(Address()), HasSubstr("start it")));
}

TEST_F(GrpcColorizerTest, RetriesShortOutageWithSameKey) {
  backend_.behave = [this](grpc::ServerContext*, Writer* writer) {
    if (backend_.calls < 3) return grpc::Status(grpc::StatusCode::UNAVAILABLE, "restarting");
    writer->Write(Picture("late"));
    return grpc::Status::OK;
  };
  Start();
  EXPECT_EQ(Colorize(), "late");
  EXPECT_EQ(backend_.calls, 3);
  EXPECT_EQ(backend_.key, "jobs/1/1");
}

TEST_F(GrpcColorizerTest, SlowBackendExceedsDeadline) {
  backend_.behave = [](grpc::ServerContext* context, Writer*) {
    while (!context->IsCancelled()) std::this_thread::sleep_for(milliseconds(10));
    return grpc::Status::CANCELLED;
  };
  options_.deadline = milliseconds(200);
  Start();
  const auto start = SteadyClock::now();
  EXPECT_THAT(Complaint([&] { Colorize(); }), HasSubstr("did not answer in time"));
  EXPECT_EQ(code_, ErrorCode::kDeadlineExceeded);
  EXPECT_LT(SteadyClock::now() - start, milliseconds(2'000));
}

TEST_F(GrpcColorizerTest, CancelledJobCancelsCall) {
  std::atomic<bool> ended{false};
  backend_.behave = [&](grpc::ServerContext* context, Writer* writer) {
    while (!context->IsCancelled()) {
      writer->Write(Share(0.1));
      std::this_thread::sleep_for(milliseconds(10));
    }
    ended = true;
    return grpc::Status::CANCELLED;
  };
  Start();
  std::thread canceller([&] {
    while (backend_.calls == 0) std::this_thread::sleep_for(milliseconds(5));
    cancel_.Cancel();
  });
  Complaint([&] { Colorize(); });
  canceller.join();
  EXPECT_EQ(code_, ErrorCode::kCancelled);
  for (int i = 0; i < 200 && !ended; ++i) std::this_thread::sleep_for(milliseconds(10));
  EXPECT_TRUE(ended) << "the backend still works";
}

TEST_F(GrpcColorizerTest, WaitsForLoadingBackendWithLimit) {
  backend_.ready_after = 4;
  Start();
  EXPECT_EQ(Remote()->GetInfo(progress_, cancel_).max_pixels, 1'000'000);
  EXPECT_GE(backend_.info_calls, 4);
  backend_.ready_after = 1 << 30;
  options_.ready_patience = milliseconds(100);
  EXPECT_THAT(Complaint([&] { Remote()->GetInfo(progress_, cancel_); }),
              HasSubstr("still loading its model"));
  EXPECT_EQ(code_, ErrorCode::kUnavailable);
}

TEST_F(GrpcColorizerTest, RefusesHugeAnswer) {
  backend_.behave = [](grpc::ServerContext*, Writer* writer) {
    writer->Write(Picture(std::string(2 << 20, 'x')));
    return grpc::Status::OK;
  };
  Start();
  EXPECT_THAT(Complaint([&] { Colorize(); }), HasSubstr("too large"));
  EXPECT_EQ(code_, ErrorCode::kFailedPrecondition);
}

TEST_F(GrpcColorizerTest, RefusesInvalidStreams) {
  Start();
  const auto complaint = [&](std::vector<backend::v1::ColorizeUpdate> updates) {
    backend_.behave = [updates](grpc::ServerContext*, Writer* writer) {
      for (const auto& update : updates) writer->Write(update);
      return grpc::Status::OK;
    };
    const std::string text = Complaint([&] { Colorize(); });
    EXPECT_EQ(code_, ErrorCode::kFailedPrecondition);
    return text;
  };
  EXPECT_THAT(complaint({}), HasSubstr("without a picture"));
  EXPECT_THAT(complaint({Share(0.5)}), HasSubstr("without a picture"));
  EXPECT_THAT(complaint({Picture("")}), HasSubstr("empty picture"));
  EXPECT_THAT(complaint({Picture("a"), Picture("b")}), HasSubstr("more data after its picture"));
}

TEST_F(GrpcColorizerTest, ProgressIsFiniteAndNeverDecreases) {
  backend_.behave = [](grpc::ServerContext*, Writer* writer) {
    for (const double share : {0.5, std::nan(""), 0.2, 1e300}) writer->Write(Share(share));
    writer->Write(Picture("png"));
    return grpc::Status::OK;
  };
  Start();
  Colorize();
  EXPECT_EQ(progress_.steps, (std::vector<int64_t>{500, 500, 1000}));
}

TEST_F(GrpcColorizerTest, LimitsGeneratedPictures) {
  Start();
  RemoteGenerateRequest request;
  request.kind = capability::kNovelView;
  request.samples = 2;
  const auto generate = [&] { return Remote()->Generate(request, progress_, cancel_); };
  EXPECT_EQ(generate(), (std::vector<std::string>{"png", "png"}));
  EXPECT_EQ(backend_.generate_kind, static_cast<int>(backend::v1::CAPABILITY_NOVEL_VIEW));
  backend_.pictures = 3;
  EXPECT_THAT(Complaint(generate), HasSubstr("more pictures than the 2"));
  backend_.pictures = 0;
  EXPECT_THAT(Complaint(generate), HasSubstr("without a picture"));
  backend_.pictures = 2;
  backend_.picture = "";
  EXPECT_THAT(Complaint(generate), HasSubstr("empty picture"));
  backend_.picture = std::string(600 << 10, 'x');
  EXPECT_THAT(Complaint(generate), HasSubstr("bytes of pictures"));
  request.kind = "film";
  EXPECT_THAT(Complaint(generate), HasSubstr("'film'"));
}

TEST_F(GrpcColorizerTest, QuotesErrorOfBackendInOneLine) {
  backend_.behave = [](grpc::ServerContext*, Writer*) {
    return grpc::Status(grpc::StatusCode::INTERNAL, "CUDA out of\nmemory");
  };
  Start();
  EXPECT_THAT(Complaint([&] { Colorize(); }), HasSubstr("\"CUDA out of memory\""));
}

TEST_F(GrpcColorizerTest, CallsCarryTraceOfJob) {
  Start();
  Colorize();
  EXPECT_EQ(backend_.traceparent, "");
  options_.traceparent = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
  Colorize();
  EXPECT_EQ(backend_.traceparent, options_.traceparent);
}

TEST_F(GrpcColorizerTest, UnknownNameListsKnownNames) {
  EXPECT_THAT(Complaint([] {
                MakeGrpcColorizer({{"a", "127.0.0.1:1"}}, "b");
              }),
              AllOf(HasSubstr("no backend 'b'"), HasSubstr("it has: a")));
}

TEST_F(GrpcColorizerTest, ProbeDistinguishesReadyLoadingAndDead) {
  Start();
  BackendProber prober({{"up", Address()}, {"down", "127.0.0.1:1"}}, milliseconds(500));
  std::map<std::string, ProbeAnswer> answers = prober.Probe();
  EXPECT_TRUE(answers["up"].ready);
  EXPECT_EQ(answers["up"].problem, "");
  EXPECT_FALSE(answers["down"].reachable);
  EXPECT_NE(answers["down"].problem, "");
  const int calls = backend_.info_calls;
  prober.Probe();
  EXPECT_EQ(backend_.info_calls, calls) << "answers are cached for a moment";
  backend_.ready_after = 1 << 30;
  BackendProber fresh({{"up", Address()}});
  EXPECT_TRUE(fresh.Probe()["up"].reachable);
  EXPECT_FALSE(fresh.Probe()["up"].ready);
}

}  // namespace
}  // namespace color3d
