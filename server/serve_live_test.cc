// ColorizeImages through the real server process, with an inference worker that runs a script.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <map>
#include <set>
#include <thread>

#include "core/base/files.h"
#include "tests/support/service/processes.h"
#include "tests/support/service/server_process.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::ServerProcess;
using testing::SleepMs;
using testing::TestClient;
using Request = v1::ColorizeImagesRequest;
using Response = v1::ColorizeImagesResponse;

// One ColorizeImages call.
struct LiveStream {
  explicit LiveStream(TestClient& client, std::chrono::milliseconds deadline = seconds(60)) {
    context.set_deadline(std::chrono::system_clock::now() + deadline);
    stream = client.colorizers->ColorizeImages(&context);
  }
  grpc::ClientContext context;
  std::unique_ptr<grpc::ClientReaderWriter<Request, Response>> stream;

  bool Send(Request request, const std::string& id, const std::string& picture) {
    request.set_request_id(id);
    if (!picture.empty()) request.set_image(picture);
    return stream->Write(request);
  }
  Response Read() {
    Response response;
    EXPECT_TRUE(stream->Read(&response)) << "the stream ended";
    return response;
  }
  // Reads until `count` answers have arrived.
  std::map<std::string, Response> ReadAll(int count) {
    std::map<std::string, Response> answers;
    for (int i = 0; i < count; ++i) {
      Response response = Read();
      answers[response.request_id()] = response;
    }
    return answers;
  }
  grpc::Status Close() {
    stream->WritesDone();
    Response response;
    while (stream->Read(&response)) continue;
    return stream->Finish();
  }
};

std::string ReasonOfError(const google::rpc::Status& error) {
  return testing::ReasonOfStatus({grpc::StatusCode::UNKNOWN, "", error.SerializeAsString()});
}
bool HasRetryInfo(const google::rpc::Status& error) {
  return testing::HasRetryInfo({grpc::StatusCode::UNKNOWN, "", error.SerializeAsString()});
}

class LiveProcessTest : public ::testing::Test {
 protected:
  void Start(std::vector<std::string> flags = {}, const std::string& folder = "server") {
    server_.reset();
    fs::create_directories(scratch_.path() / folder);
    server_ = std::make_unique<ServerProcess>(scratch_.path() / folder, std::move(flags));
  }
  TestClient& client() { return server_->client(); }
  Request Example() {
    Request request;
    *request.mutable_example() = client().Upload("example");
    return request;
  }
  // A personalized scene; its scripted answers begin with the digest of the blob.
  v1::Colorizer MakeColorizer() {
    v1::JobSpec spec;
    spec.set_scene(client().MakeScene().name());
    spec.set_skip_cache(true);
    *spec.mutable_colorize_scene()->mutable_key_color()->mutable_image() = client().Upload("key");
    const v1::Job job = client().WaitFinished(client().Create(spec).name());
    EXPECT_EQ(job.state(), v1::Job::STATE_SUCCEEDED) << job.DebugString();
    v1::ListColorizersRequest request;
    request.set_scene(spec.scene());
    grpc::ClientContext context;
    v1::ListColorizersResponse response;
    client().colorizers->ListColorizers(&context, request, &response);
    EXPECT_EQ(response.colorizers_size(), 1);
    return response.colorizers(0);
  }
  pid_t InferenceWorker() {
    WaitUntil([&] { return !server_->Workers(/*inference=*/true).empty(); }, seconds(20));
    const auto pids = server_->Workers(/*inference=*/true);
    return pids.empty() ? 0 : pids[0];
  }

  ScratchFolder scratch_;
  std::unique_ptr<ServerProcess> server_;
};

TEST_F(LiveProcessTest, ScenesInOneStreamGetTheirOwnColors) {
  Start();
  const v1::Colorizer first = MakeColorizer(), second = MakeColorizer();
  ASSERT_NE(first.scene(), second.scene());
  ASSERT_NE(first.name(), second.name());
  LiveStream live(client());
  for (int i = 0; i < 60; ++i) {
    const v1::Colorizer& wanted = i % 2 == 0 ? first : second;
    Request request;
    if (i % 3 == 0) {
      request.set_colorizer(wanted.name());
    } else {
      request.set_scene(wanted.scene());
    }
    ASSERT_TRUE(live.Send(request, std::to_string(i), "picture" + std::to_string(i)));
  }
  int together = 0;
  for (const auto& [id, response] : live.ReadAll(60)) {
    const v1::Colorizer& wanted = std::stoi(id) % 2 == 0 ? first : second;
    EXPECT_EQ(response.image(), wanted.file().sha256() + " picture" + id);
    EXPECT_EQ(response.colorizer(), wanted.name());
    EXPECT_EQ(response.scene(), wanted.scene());
    EXPECT_THAT(response.encoder_digest(), HasSubstr("scripted"));
    if (response.batch_size() > 1) ++together;
  }
  EXPECT_GT(together, 5) << "pictures that waited together were not coloured together";
  EXPECT_TRUE(live.Close().ok());
}

TEST_F(LiveProcessTest, BadPictureGetsErrorAndStreamContinues) {
  Start();
  const std::string bare = client().MakeScene().name();
  const v1::Colorizer made = MakeColorizer();
  LiveStream live(client());
  const auto expect = [&](const char* what,
                          const Request& request,
                          const std::string& picture,
                          grpc::StatusCode code,
                          const std::string& reason) {
    ASSERT_TRUE(live.Send(request, what, picture));
    const Response response = live.Read();
    EXPECT_EQ(response.request_id(), what);
    EXPECT_EQ(response.error().code(), code) << what << ": " << response.error().message();
    EXPECT_EQ(ReasonOfError(response.error()), reason) << what;
    EXPECT_TRUE(response.image().empty());
  };
  using grpc::StatusCode;
  Request request;
  expect("nothing", request, "x", StatusCode::INVALID_ARGUMENT, "INVALID_ARGUMENT");
  request.set_scene("scenes/none");
  expect("no such scene", request, "x", StatusCode::NOT_FOUND, "SCENE_NOT_FOUND");
  request.set_scene(bare);
  expect("not personalized", request, "x", StatusCode::NOT_FOUND, "COLORIZER_NOT_FOUND");
  request.set_colorizer(made.name());
  expect("of another scene", request, "x", StatusCode::INVALID_ARGUMENT, "OTHER_SCENE");
  request.clear_scene();
  expect("no picture", request, "", StatusCode::INVALID_ARGUMENT, "INVALID_ARGUMENT");
  expect("too large",
         request,
         std::string((3 << 20) + 1, 'x'),
         StatusCode::INVALID_ARGUMENT,
         "IMAGE_TOO_LARGE");
  expect("damaged", request, "damaged", StatusCode::INVALID_ARGUMENT, "INVALID_ARGUMENT");
  request.set_max_side_px(7);
  expect("size", request, "x", StatusCode::INVALID_ARGUMENT, "INVALID_ARGUMENT");
  request.clear_max_side_px();
  *request.mutable_image_digest() = testing::DigestOf("missing");
  expect("no such blob", request, "", StatusCode::NOT_FOUND, "BLOB_MISSING");
  request.clear_image_digest();
  request.set_colorizer("colorizers/" + std::string(64, '0'));
  expect("no such colorizer", request, "x", StatusCode::NOT_FOUND, "COLORIZER_NOT_FOUND");
  request.set_colorizer(made.name());
  ASSERT_TRUE(live.Send(request, std::string(200, 'i'), "x"));
  EXPECT_EQ(live.Read().error().code(), StatusCode::INVALID_ARGUMENT);
  ASSERT_TRUE(live.Send(request, "good", "x"));
  EXPECT_EQ(live.Read().image(), made.file().sha256() + " x");
  EXPECT_TRUE(live.Close().ok());
}

TEST_F(LiveProcessTest, PicturesOfKilledWorkerFailAndNextIsColored) {
  Start();
  LiveStream live(client());
  const Request example = Example();
  live.Send(example, "warm", "x");
  EXPECT_FALSE(live.Read().image().empty());
  const pid_t worker = InferenceWorker();
  ASSERT_NE(worker, 0);
  for (int i = 0; i < 8; ++i) live.Send(example, std::to_string(i), "slow");
  SleepMs(300);
  const auto start = std::chrono::steady_clock::now();
  ::kill(worker, SIGKILL);
  int lost = 0;
  for (const auto& [id, response] : live.ReadAll(8)) {
    if (!response.has_error()) continue;
    ++lost;
    EXPECT_EQ(response.error().code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_EQ(ReasonOfError(response.error()), "INFERENCE_LOST");
    EXPECT_TRUE(HasRetryInfo(response.error()));
  }
  EXPECT_GT(lost, 0);
  EXPECT_LT(std::chrono::steady_clock::now() - start, seconds(5));
  live.Send(example, "again", "x");
  EXPECT_FALSE(live.Read().image().empty()) << "the worker did not come back";
  EXPECT_TRUE(live.Close().ok());
}

TEST_F(LiveProcessTest, PictureThatKilledWorkerIsNotSentAgain) {
  Start();
  LiveStream live(client());
  live.Send(Example(), "poison", "crash");
  EXPECT_EQ(ReasonOfError(live.Read().error()), "INFERENCE_LOST");
  for (int i = 0; i < 3; ++i) {
    live.Send(Example(), "good", "x");
    EXPECT_FALSE(live.Read().has_error());
  }
  EXPECT_TRUE(live.Close().ok());
}

// A client that resends lost pictures as requested.
TEST_F(LiveProcessTest, PictureThatKillsWorkersIsIsolated) {
  Start();
  LiveStream live(client());
  const Request example = Example();
  std::map<std::string, std::string> words = {{"poison", "crash"}};
  for (int i = 0; i < 6; ++i) words["good" + std::to_string(i)] = "slow," + std::to_string(i);
  std::map<std::string, int> lost;
  for (const auto& [id, word] : words) live.Send(example, id, word);
  for (int answers = 0; !words.empty() && answers < 40; ++answers) {
    const Response response = live.Read();
    const std::string& id = response.request_id();
    if (!response.has_error()) {
      EXPECT_TRUE(id.starts_with("good"));
      words.erase(id);
    } else if (ReasonOfError(response.error()) == "INFERENCE_LOST") {
      EXPECT_LT(++lost[id], 3) << id;
      live.Send(example, id, words.at(id));
    } else {
      EXPECT_EQ(ReasonOfError(response.error()), "PICTURE_KILLS_WORKER");
      EXPECT_EQ(id, "poison");
      words.erase(id);
    }
  }
  EXPECT_TRUE(words.empty());
  EXPECT_EQ(lost["poison"], 2);
  for (const auto& [id, count] : lost) EXPECT_LE(count, id == "poison" ? 2 : 1) << id;
  EXPECT_TRUE(live.Close().ok());
}

TEST_F(LiveProcessTest, SlowReaderUsesBoundedMemoryAndLosesNothing) {
  Start();
  constexpr int kPictures = 150;  // coloured, 1 MiB each
  LiveStream live(client());
  const Request example = Example();
  live.Send(example, "warm", "x");
  live.Read();
  const int64_t before = server_->Info().memory_bytes();
  std::atomic<int> sent{0};
  std::thread writer([&] {
    for (; sent < kPictures; ++sent) {
      if (!live.Send(example, std::to_string(sent), "big" + std::string(100'000, 'x'))) return;
    }
  });
  SleepMs(2'000);
  EXPECT_LT(sent, kPictures) << "the server read without being read from";
  EXPECT_LT(server_->Info().memory_bytes() - before, int64_t{100} << 20);
  LiveStream other(client());
  other.Send(example, "other", "x");
  EXPECT_FALSE(other.Read().image().empty()) << "one slow reader stopped another stream";
  std::set<std::string> ids;
  for (const auto& [id, response] : live.ReadAll(kPictures)) {
    EXPECT_GT(response.image().size(), size_t{1} << 20);
    ids.insert(id);
  }
  EXPECT_EQ(ids.size(), static_cast<size_t>(kPictures));
  writer.join();
  EXPECT_TRUE(live.Close().ok());
}

TEST_F(LiveProcessTest, CancelledAndLateStreamsReleaseTheirPlaces) {
  Start();
  const Request example = Example();
  LiveStream late(client(), std::chrono::milliseconds(700));
  for (int i = 0; i < 10; ++i) late.Send(example, "late", "slow");
  EXPECT_EQ(late.Close().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  for (int round = 0; round < 20; ++round) {
    LiveStream live(client());
    for (int i = 0; i < 12; ++i) live.Send(example, "x", "x");
    live.Read();
    live.context.TryCancel();
    EXPECT_EQ(live.Close().error_code(), grpc::StatusCode::CANCELLED);
  }
  LiveStream live(client());
  for (int i = 0; i < 40; ++i) live.Send(example, std::to_string(i), "x");
  EXPECT_EQ(live.ReadAll(40).size(), 40u) << "cancelled pictures still count";
  EXPECT_TRUE(live.Close().ok());
}

TEST_F(LiveProcessTest, DrainAnswersPendingPicturesAndEndsWorker) {
  Start();
  LiveStream live(client()), quiet(client());
  const Request example = Example();
  live.Send(example, "warm", "x");
  live.Read();
  const pid_t worker = InferenceWorker();
  for (int i = 0; i < 12; ++i) live.Send(example, std::to_string(i), "slow");
  live.Read();
  const auto start = std::chrono::steady_clock::now();
  server_->Signal(SIGTERM);
  int answered = 0;
  for (Response response; live.stream->Read(&response); ++answered) {
    EXPECT_FALSE(response.has_error()) << response.error().message();
  }
  EXPECT_GT(answered, 0);
  for (LiveStream* stream : {&live, &quiet}) {
    const grpc::Status status = stream->Close();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_EQ(testing::ReasonOfStatus(status), "DRAINING");
  }
  EXPECT_EQ(server_->Wait(), 0);
  EXPECT_LT(std::chrono::steady_clock::now() - start, seconds(15));
  EXPECT_FALSE(IsAlive(worker));
}

TEST_F(LiveProcessTest, WorkerEndsWithKilledServer) {
  Start();
  {
    LiveStream live(client());
    live.Send(Example(), "x", "x");
    live.Read();
  }
  const pid_t worker = InferenceWorker();
  server_->Signal(SIGKILL);
  server_->Wait();
  Start();
  LiveStream live(client());
  live.Send(Example(), "x", "x");
  EXPECT_FALSE(live.Read().image().empty());
  EXPECT_TRUE(WaitUntil([&] { return !IsAlive(worker); }, seconds(20)));
  live.Send(Example(), "x", "x");
  EXPECT_FALSE(live.Read().image().empty()) << "the old worker took the new one's socket away";
}

// The path of a Unix socket has at most 107 bytes.
TEST_F(LiveProcessTest, AcceptsLongPathOfDataFolder) {
  Start({}, std::string(120, 'd') + "/" + std::string(120, 'e'));
  LiveStream live(client());
  live.Send(Example(), "x", "x");
  EXPECT_FALSE(live.Read().image().empty());
  const fs::path folder = scratch_.path() / std::string(120, 'd') / std::string(120, 'e');
  EXPECT_EQ(fs::status(folder / "data" / "sockets").permissions(), fs::perms::owner_all);
}

TEST_F(LiveProcessTest, StartsWorkerAtFirstRequest) {
  Start();
  SleepMs(500);
  EXPECT_TRUE(server_->Workers(/*inference=*/true).empty());
  LiveStream live(client());
  EXPECT_NE(InferenceWorker(), 0) << "opening a stream does not get the worker ready";
}

}  // namespace
}  // namespace color3d
