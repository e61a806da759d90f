#include "server/rpc/jobs/job_log_stream.h"

#include <gtest/gtest.h>

#include <deque>
#include <fstream>
#include <functional>
#include <memory>
#include <thread>

#include "server/ops/job_log.h"
#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {

class JobLogStreamTest : public RpcTest {
 protected:
  void Write(const std::string& text) {
    std::ofstream(JobLogFile(scratch_.path(), job_.name()), std::ios::app) << text;
  }
  std::string ReadAll(int64_t offset, bool follow, grpc::Status* status = nullptr) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
    v1::ReadJobLogRequest request;
    request.set_name(job_.name());
    request.set_offset(offset);
    request.set_follow(follow);
    auto stream = client_->jobs->ReadJobLog(&context, request);
    v1::JobLogChunk chunk;
    std::string text;
    while (stream->Read(&chunk)) {
      EXPECT_EQ(chunk.offset(), offset + static_cast<int64_t>(text.size()));
      text += chunk.data();
    }
    const grpc::Status end = stream->Finish();
    if (status != nullptr) *status = end;
    return text;
  }

  static bool Becomes(const std::function<bool()>& done) {
    for (int i = 0; i < 1000 && !done(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return done();
  }

  v1::Job job_ = client_->Create(ScriptedSpec(client_->MakeScene().name(), "a"));
};

TEST_F(JobLogStreamTest, FromAnyByteInWholeLines) {
  EXPECT_EQ(ReadAll(0, false), "") << "nothing was written";
  const std::string line(999, 'x');
  std::string all;
  for (int i = 0; i < 200; ++i) all += line + "\n";
  Write(all + "half a li");
  EXPECT_EQ(ReadAll(0, false), all);
  EXPECT_EQ(ReadAll(150'000, false), all.substr(150'000));
  EXPECT_EQ(ReadAll(1 << 30, false), "");
  grpc::Status status;
  ReadAll(-1, false, &status);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(JobLogStreamTest, FollowsUntilTheJobHasEnded) {
  Write("begins\n");
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    Write("ends\n");
    Work();
  });
  EXPECT_EQ(ReadAll(0, true), "begins\nends\n");
  later.join();
}

TEST_F(JobLogStreamTest, ADrainEndsIt) {
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    server_->StartDraining();
  });
  grpc::Status status;
  ReadAll(0, true, &status);
  EXPECT_EQ(ReasonOfStatus(status), "DRAINING");
  later.join();
}

// Those who go in the middle of a pause take nothing away from under the step that began it.
TEST_F(JobLogStreamTest, ReadersThatGoAwayEndTheirStreams) {
  constexpr int kReaders = 50;
  std::deque<grpc::ClientContext> contexts(kReaders);
  std::vector<std::unique_ptr<grpc::ClientReader<v1::JobLogChunk>>> streams;
  v1::ReadJobLogRequest request;
  request.set_name(job_.name());
  request.set_follow(true);
  for (grpc::ClientContext& context : contexts) {
    streams.push_back(client_->jobs->ReadJobLog(&context, request));
  }
  EXPECT_TRUE(Becomes([&] { return server_->open().watches == kReaders; }));
  for (grpc::ClientContext& context : contexts) context.TryCancel();
  for (auto& stream : streams) {
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  EXPECT_TRUE(Becomes([&] { return server_->open().watches == 0; }));
}

}  // namespace
}  // namespace color3d::testing
