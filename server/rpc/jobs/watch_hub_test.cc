#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <thread>

#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {
using WatchHubTest = RpcTest;

TEST_F(WatchHubTest, WatchShowsEveryStateAndEnds) {
  const std::string scene = client_->MakeScene().name();
  const std::string name = client_->Create(ScriptedSpec(scene, "steps=1")).name();
  v1::WatchJobsRequest request;
  request.add_names(name);
  grpc::ClientContext context;
  auto stream = client_->jobs->WatchJobs(&context, request);
  v1::JobEvent event;
  ASSERT_TRUE(stream->Read(&event));
  ASSERT_TRUE(stream->Read(&event));
  EXPECT_EQ(event.kind(), v1::JobEvent::KIND_STATE);
  EXPECT_EQ(Work(), 2);
  int64_t revision = event.revision();
  std::vector<v1::Job::State> states;
  std::vector<int64_t> revisions;
  while (stream->Read(&event)) {
    EXPECT_GT(event.revision(), revision);
    revision = event.revision();
    if (event.job().name() != name) continue;
    states.push_back(event.job().state());
    revisions.push_back(event.revision());
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_THAT(states,
              ::testing::ElementsAre(
                  v1::Job::STATE_QUEUED, v1::Job::STATE_RUNNING, v1::Job::STATE_SUCCEEDED));
  EXPECT_EQ(event.job().artifacts_size(), 1) << "the last state is complete";

  // A connection that broke after RUNNING goes on from there.
  request.set_after_revision(revisions.at(1));
  grpc::ClientContext resumed_context;
  auto resumed = client_->jobs->WatchJobs(&resumed_context, request);
  std::vector<v1::Job::State> rest;
  while (resumed->Read(&event)) rest.push_back(event.job().state());
  EXPECT_TRUE(resumed->Finish().ok());
  EXPECT_THAT(rest, ::testing::ElementsAre(v1::Job::STATE_SUCCEEDED));

  request.set_after_revision(1'000'000);
  grpc::ClientContext future_context;
  auto future = client_->jobs->WatchJobs(&future_context, request);
  EXPECT_FALSE(future->Read(&event));
  EXPECT_EQ(future->Finish().error_code(), grpc::StatusCode::OUT_OF_RANGE);
}

TEST_F(WatchHubTest, WatchCoalescesProgressAndKeepsAlive) {
  const std::string scene = client_->MakeScene().name();
  v1::JobSpec spec;
  spec.set_scene(scene);
  spec.mutable_import_scene();
  const std::string name = client_->Create(spec).name();
  const auto job = store_.Claim("w", 60'000);
  ASSERT_TRUE(job);
  v1::WatchJobsRequest request;
  request.add_names(name);
  request.set_min_progress_interval_ms(200);
  grpc::ClientContext context;
  auto stream = client_->jobs->WatchJobs(&context, request);
  v1::JobEvent event;
  ASSERT_TRUE(stream->Read(&event));
  for (int step = 1; step <= 100; ++step) {
    ProgressRecord progress;
    progress.step = step;
    store_.Heartbeat({job->id, job->lease_epoch}, progress, {}, 60'000);
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
  }
  int progress_events = 0;
  do {
    ASSERT_TRUE(stream->Read(&event));
    ++progress_events;
    EXPECT_EQ(event.kind(), v1::JobEvent::KIND_PROGRESS);
  } while (event.job().progress().step() < 100);
  EXPECT_LE(progress_events, 6) << "100 steps in 0.3 s at 5 a second";
  ASSERT_TRUE(stream->Read(&event));
  EXPECT_EQ(event.kind(), v1::JobEvent::KIND_KEEPALIVE);
  context.TryCancel();
  stream->Finish();
}

TEST_F(WatchHubTest, ManyWatchersOfWhichSomeStall) {
  const std::string scene = client_->MakeScene().name();
  const std::string name = client_->Create(ScriptedSpec(scene, "steps=1")).name();
  v1::WatchJobsRequest request;
  request.add_names(name);
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::JobEvent>>> streams;
  for (int i = 0; i < 60; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    streams.push_back(client_->jobs->WatchJobs(contexts.back().get(), request));
  }
  EXPECT_EQ(client_->Get(name).state(), v1::Job::STATE_BLOCKED) << "unary calls are answered";
  EXPECT_EQ(Work(), 2);
  for (size_t i = 0; i < streams.size(); i += 2) {  // every other one is never read
    v1::JobEvent event;
    while (streams[i]->Read(&event)) {
    }
    EXPECT_TRUE(streams[i]->Finish().ok());
    EXPECT_EQ(event.job().state(), v1::Job::STATE_SUCCEEDED);
  }
  for (size_t i = 1; i < streams.size(); i += 2) contexts[i]->TryCancel();
  for (size_t i = 1; i < streams.size(); i += 2) streams[i]->Finish();
}

TEST_F(WatchHubTest, StreamsAreLimited) {
  const std::string name =
      client_->Create(ScriptedSpec(client_->MakeScene().name(), "steps=1")).name();
  v1::WatchJobsRequest request;
  request.add_names(name);
  struct Open {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReader<v1::JobEvent>> stream;
  };
  std::vector<std::unique_ptr<Open>> open;
  v1::JobEvent event;
  const auto watch = [&] {
    auto one = std::make_unique<Open>();
    one->stream = client_->jobs->WatchJobs(&one->context, request);
    if (!one->stream->Read(&event)) return one->stream->Finish();
    open.push_back(std::move(one));
    return grpc::Status::OK;
  };
  for (int i = 0; i < kMaxWatches; ++i) ASSERT_TRUE(watch().ok()) << i;
  const grpc::Status refused = watch();
  EXPECT_EQ(ReasonOfStatus(refused), "TOO_MANY_STREAMS");
  EXPECT_TRUE(HasRetryInfo(refused));
  open.back()->context.TryCancel();
  open.pop_back();
  grpc::Status again;
  for (int i = 0; i < 200 && !(again = watch()).ok(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(again.ok());
}

}  // namespace
}  // namespace color3d::testing
