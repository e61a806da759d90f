// Clients that open all allowed streams and read nothing, or send more than is processed: the
// server uses bounded memory for them in sum, and answers others.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <deque>
#include <thread>

#include "core/base/files.h"
#include "tests/support/service/process_sizes.h"
#include "tests/support/service/server_process.h"

namespace color3d::testing {
namespace {
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr int kConnections = 8;

class SlowClientsTest : public ::testing::Test {
 protected:
  // Separate connections, unlike default channels of gRPC.
  SlowClientsTest() {
    for (int i = 0; i < kConnections; ++i) {
      grpc::ChannelArguments arguments;
      arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
      // Unread data stays with the server.
      arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
      arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 64 << 10);
      connections_.emplace_back(grpc::CreateCustomChannel(
          server_.address(), grpc::InsecureChannelCredentials(), arguments));
    }
    good_.MakeScene();  // uses each call once
    before_mib_ = PeakMib();
  }
  ~SlowClientsTest() override {
    for (grpc::ClientContext& context : contexts_) context.TryCancel();
    std::printf("at most %.0f MiB more for them\n", PeakMib() - before_mib_);
  }
  double PeakMib() const { return SizesOf({server_.pid()}).peak_mib; }
  double GrowthMib() const { return PeakMib() - before_mib_; }
  TestClient& Connection(int i) { return connections_[static_cast<size_t>(i) % kConnections]; }
  // A scene with this number of files; its answer has about 90 bytes per file.
  v1::CreateSceneRequest BigScene(int files) {
    v1::CreateSceneRequest request;
    for (int i = 0; i < files; ++i) {
      v1::SceneFile* file = request.add_files();
      file->set_path("images/" + std::to_string(i) + ".png");
      *file->mutable_digest() = DigestOf(std::to_string(i));
    }
    return request;
  }
  // Retried with growing delays after a connection that gRPC closed, like clients do.
  void Try(const std::string& content) {
    for (int tries = 0; tries < 5; ++tries) {
      try {
        EXPECT_EQ(good_.Download(good_.Upload(content)), content);
        return;
      } catch (const std::runtime_error& e) {
        std::printf("try %d: %s\n", tries, e.what());
        SleepMs(100 << tries);
      }
    }
    ADD_FAILURE() << "five tries in vain";
  }
  // Returns the duration of the slowest of a few calls of a normal client.
  milliseconds SlowestOfOthers() {
    milliseconds slowest(0);
    for (int i = 0; i < 20; ++i) {
      const auto start = steady_clock::now();
      Try("good" + std::to_string(i));
      slowest =
          std::max(slowest, std::chrono::duration_cast<milliseconds>(steady_clock::now() - start));
    }
    return slowest;
  }

  ScratchFolder scratch_;
  ServerProcess server_{scratch_.path(), {}};
  TestClient& good_ = server_.client();
  std::deque<TestClient> connections_;
  std::deque<grpc::ClientContext> contexts_;
  double before_mib_ = 0.0;
};

TEST_F(SlowClientsTest, BoundsMemoryOfUnreadStreams) {
  constexpr int kWatches = 900, kDownloads = 240;
  const v1::Digest blob = good_.Upload(std::string(2 << 20, 'b'));
  const std::string job = good_.Create(ScriptedSpec(good_.MakeScene().name(), "steps=1")).name();
  good_.WaitFinished(job);
  before_mib_ = PeakMib();
  std::vector<std::unique_ptr<grpc::ClientReader<v1::JobEvent>>> watches;
  for (int i = 0; i < kWatches; ++i) {
    v1::WatchJobsRequest request;
    request.add_names(job);
    watches.push_back(Connection(i).jobs->WatchJobs(&contexts_.emplace_back(), request));
  }
  std::vector<std::unique_ptr<grpc::ClientReader<google::bytestream::ReadResponse>>> downloads;
  for (int i = 0; i < kDownloads; ++i) {
    google::bytestream::ReadRequest request;
    request.set_resource_name("blobs/" + blob.sha256() + "/" + std::to_string(blob.size_bytes()));
    downloads.push_back(Connection(i).bytes->Read(&contexts_.emplace_back(), request));
  }
  SleepMs(2'000);
  EXPECT_LT(SlowestOfOthers(), milliseconds(2'000));
  EXPECT_LT(GrowthMib(), 300.0);
}

// More uploads than allowed, each with the largest message that gRPC accepts.
TEST_F(SlowClientsTest, BoundsMemoryOfRefusedUploads) {
  constexpr int kThreads = 24, kUploads = 20;
  google::bytestream::WriteRequest request;
  request.set_resource_name("uploads/u/blobs/" + DigestOf("x").sha256() + "/100000000");
  request.set_data(std::string(15 << 20, 'x'));
  for (int i = 0; i < kThreads * kUploads; ++i) contexts_.emplace_back();
  std::atomic<int> refused{0};
  std::vector<std::jthread> threads;
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&, i] {
      std::vector<std::unique_ptr<grpc::ClientWriter<google::bytestream::WriteRequest>>> streams;
      google::bytestream::WriteResponse response;
      for (int k = 0; k < kUploads; ++k) {
        grpc::ClientContext& context = contexts_[static_cast<size_t>(i * kUploads + k)];
        streams.push_back(Connection(i).bytes->Write(&context, &response));
        streams.back()->Write(request);
      }
      for (const auto& stream : streams) refused += stream->Finish().ok() ? 0 : 1;
    });
  }
  const milliseconds slowest = SlowestOfOthers();
  for (std::jthread& thread : threads) thread.join();
  EXPECT_EQ(refused, kThreads * kUploads);
  EXPECT_LT(slowest, milliseconds(5'000));
  EXPECT_LT(GrowthMib(), 800.0) << "of 7,200 that were sent";
}

TEST_F(SlowClientsTest, BoundsMemoryOfUnreadAnswers) {
  constexpr int kCalls = 800, kFiles = 8'000;
  v1::Scene scene;
  grpc::ClientContext context;
  const grpc::Status created = good_.scenes->CreateScene(&context, BigScene(kFiles), &scene);
  ASSERT_TRUE(created.ok()) << created.error_message();
  const double answer_mib = static_cast<double>(scene.ByteSizeLong()) / (1 << 20);
  ASSERT_GT(kCalls * answer_mib, 500.0) << "they must ask for more than the server may keep";
  v1::GetSceneRequest request;
  request.set_name(scene.name());
  grpc::CompletionQueue queue;
  std::deque<std::unique_ptr<grpc::ClientAsyncResponseReader<v1::Scene>>> calls;
  for (int i = 0; i < kCalls; ++i) {
    calls.push_back(
        Connection(i).scenes->PrepareAsyncGetScene(&contexts_.emplace_back(), request, &queue));
    calls.back()->StartCall();
    calls.back()->ReadInitialMetadata(nullptr);  // requests, but does not read the answer
  }
  void* tag = nullptr;
  bool ok = false;
  int begun = 0;
  while (begun < kCalls &&
         queue.AsyncNext(&tag, &ok, std::chrono::system_clock::now() + std::chrono::seconds(5)) ==
             grpc::CompletionQueue::GOT_EVENT) {
    ++begun;
  }
  EXPECT_LT(SlowestOfOthers(), milliseconds(2'000));
  EXPECT_LT(GrowthMib(), 700.0);
  // Clients that read may make the same calls.
  grpc::ClientContext other;
  EXPECT_TRUE(good_.scenes->GetScene(&other, request, &scene).ok());
  // Refused calls report it.
  int refused = 0;
  std::deque<grpc::Status> statuses(kCalls);
  std::deque<v1::Scene> answers(kCalls);
  for (int i = 0; i < kCalls; ++i) {
    const auto n = static_cast<size_t>(i);
    calls[n]->Finish(&answers[n], &statuses[n], nullptr);
  }
  for (int i = 0; i < kCalls; ++i) ASSERT_TRUE(queue.Next(&tag, &ok));
  for (const grpc::Status& status : statuses) {
    if (status.ok()) continue;
    ++refused;
    EXPECT_EQ(ReasonOfStatus(status), "OVERLOADED") << status.error_message();
  }
  EXPECT_GT(refused, kCalls / 10);
  EXPECT_LT(refused, kCalls) << "nobody was answered";
  queue.Shutdown();
  while (queue.Next(&tag, &ok)) {
  }
}

TEST_F(SlowClientsTest, BoundsMemoryOfWaitingRequests) {
  constexpr int kCalls = 96;
  v1::CreateSceneRequest request = BigScene(10);
  request.set_display_name(std::string(15 << 20, 'n'));  // refused after it was read
  std::atomic<int> invalid{0}, others{0};
  std::vector<std::jthread> threads;
  for (int i = 0; i < kCalls; ++i) {
    grpc::ClientContext& context = contexts_.emplace_back();
    threads.emplace_back([&, i] {
      v1::Scene scene;
      const grpc::Status status = Connection(i).scenes->CreateScene(&context, request, &scene);
      ++(status.error_code() == grpc::StatusCode::INVALID_ARGUMENT ? invalid : others);
    });
  }
  const milliseconds slowest = SlowestOfOthers();
  for (std::jthread& thread : threads) thread.join();
  EXPECT_LT(slowest, milliseconds(5'000));
  EXPECT_LT(GrowthMib(), 1'000.0) << "of 1,440 that were sent";
  std::printf("%d refused for what they say, %d otherwise\n", invalid.load(), others.load());
}

}  // namespace
}  // namespace color3d::testing
