#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <thread>

#include "tests/support/rpc_fixture.h"

namespace color3d::testing {
namespace {
using ::testing::HasSubstr;
using JobRpcTest = RpcTest;

TEST_F(JobRpcTest, RequestIdsAreIdempotentAndBound) {
  const std::string scene = client_->MakeScene().name();
  const v1::JobSpec spec = ScriptedSpec(scene, "steps=1");
  const v1::Job first = client_->Create(spec, kUuid);
  EXPECT_EQ(client_->Create(spec, kUuid).name(), first.name());
  const grpc::Status reused = CreateStatus(ScriptedSpec(scene, "steps=2"), kUuid);
  EXPECT_EQ(reused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(ReasonOfStatus(reused), "REQUEST_ID_REUSED");
  EXPECT_EQ(CreateStatus(spec, "not a uuid").error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(client_->Children(scene).size(), 2u);
}

TEST_F(JobRpcTest, RefusedJobs) {
  const std::string scene = client_->MakeScene().name();
  v1::JobSpec spec;
  spec.set_scene(scene);
  spec.mutable_reconstruct_dense();
  grpc::Status status = CreateStatus(spec);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_THAT(status.error_message(), HasSubstr("reconstruct_dense"));
  *spec.mutable_colorize_scene()->mutable_key_color()->mutable_image() = DigestOf("absent");
  status = CreateStatus(spec);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ReasonOfStatus(status), "BLOB_MISSING");
  spec.mutable_solve_chroma();
  status = CreateStatus(spec);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ReasonOfStatus(status), "INPUT_MISSING");
  spec.mutable_import_scene();
  spec.set_scene("scenes/none");
  EXPECT_EQ(CreateStatus(spec).error_code(), grpc::StatusCode::NOT_FOUND);
  spec.set_scene("../x");
  EXPECT_EQ(CreateStatus(spec).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(JobRpcTest, FullQueueSaysWhenToComeBack) {
  const std::string scene = client_->MakeScene().name();
  grpc::Status status;
  for (int i = 0; i < 30 && status.ok(); ++i) {
    status = CreateStatus(ScriptedSpec(scene, "steps=1", i + 1));
  }
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOfStatus(status), "QUEUE_FULL");
  EXPECT_TRUE(HasRetryInfo(status));
}

TEST_F(JobRpcTest, ListsArePaged) {
  const std::string scene = client_->MakeScene().name();
  for (int i = 0; i < 5; ++i) client_->Create(ScriptedSpec(scene, "steps=1", i + 1));
  std::set<std::string> names;
  v1::ListJobsRequest request;
  request.set_page_size(3);
  int pages = 0;
  do {
    grpc::ClientContext context;
    v1::ListJobsResponse response;
    ASSERT_TRUE(client_->jobs->ListJobs(&context, request, &response).ok());
    EXPECT_LE(response.jobs_size(), 3);
    for (const v1::Job& job : response.jobs()) EXPECT_TRUE(names.insert(job.name()).second);
    request.set_page_token(response.next_page_token());
    ++pages;
  } while (!request.page_token().empty());
  EXPECT_EQ(names.size(), 10u);
  EXPECT_EQ(pages, 4);
  grpc::ClientContext context;
  v1::ListJobsResponse response;
  request.set_page_token("99.garbage");
  EXPECT_EQ(client_->jobs->ListJobs(&context, request, &response).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
  v1::ListScenesRequest scenes_request;
  v1::ListScenesResponse scenes;
  grpc::ClientContext scenes_context;
  ASSERT_TRUE(client_->scenes->ListScenes(&scenes_context, scenes_request, &scenes).ok());
  EXPECT_EQ(scenes.scenes_size(), 1);
}

TEST_F(JobRpcTest, CancelRetryDelete) {
  const std::string scene = client_->MakeScene().name();
  const std::string name = client_->Create(ScriptedSpec(scene, "steps=1")).name();
  v1::CancelJobRequest cancel;
  cancel.set_name(name);
  v1::Job job;
  grpc::ClientContext context1;
  ASSERT_TRUE(client_->jobs->CancelJob(&context1, cancel, &job).ok());
  EXPECT_EQ(job.state(), v1::Job::STATE_CANCELLED);
  EXPECT_EQ(client_->Children(name).at(0).state(), v1::Job::STATE_CANCELLED);
  v1::RetryJobRequest retry;
  retry.set_name(name);
  grpc::ClientContext context2;
  ASSERT_TRUE(client_->jobs->RetryJob(&context2, retry, &job).ok());
  EXPECT_EQ(job.state(), v1::Job::STATE_BLOCKED);
  EXPECT_EQ(Work(), 2);
  EXPECT_EQ(client_->Get(name).state(), v1::Job::STATE_SUCCEEDED);
  grpc::ClientContext context3;
  const grpc::Status again = client_->jobs->RetryJob(&context3, retry, &job);
  EXPECT_EQ(again.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  v1::DeleteJobRequest remove;
  remove.set_name(name);
  v1::DeleteJobResponse removed;
  grpc::ClientContext context4;
  ASSERT_TRUE(client_->jobs->DeleteJob(&context4, remove, &removed).ok());
  grpc::ClientContext context5;
  EXPECT_EQ(client_->jobs->DeleteJob(&context5, remove, &removed).error_code(),
            grpc::StatusCode::NOT_FOUND);
}

TEST_F(JobRpcTest, WatchShowsEveryStateAndEnds) {
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

TEST_F(JobRpcTest, WatchCoalescesProgressAndKeepsAlive) {
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

TEST_F(JobRpcTest, ManyWatchersOfWhichSomeStall) {
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

TEST_F(JobRpcTest, DrainingRefusesJobsAndEndsStreams) {
  const std::string scene = client_->MakeScene().name();
  const std::string name = client_->Create(ScriptedSpec(scene, "steps=1")).name();
  v1::WatchJobsRequest request;
  request.add_names(name);
  grpc::ClientContext context;
  auto stream = client_->jobs->WatchJobs(&context, request);
  v1::JobEvent event;
  ASSERT_TRUE(stream->Read(&event));
  server_->StartDraining();
  while (stream->Read(&event)) {
  }
  const grpc::Status ended = stream->Finish();
  EXPECT_EQ(ended.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(ReasonOfStatus(ended), "DRAINING");
  EXPECT_TRUE(HasRetryInfo(ended));
  EXPECT_EQ(ReasonOfStatus(CreateStatus(ScriptedSpec(scene, "steps=2"))), "DRAINING");
  EXPECT_EQ(client_->Get(name).name(), name) << "reads go on";
}

TEST_F(JobRpcTest, FailedJobsCarryTheirError) {
  const std::string scene = client_->MakeScene().name();
  const std::string name = client_->Create(ScriptedSpec(scene, "steps=1")).name();
  const auto job = store_.Claim("w", 60'000);
  store_.Fail({job->id, job->lease_epoch}, {ErrorCode::kDataLoss, "BROKEN", "it broke"}, {});
  const v1::Job failed = client_->Get(name);
  EXPECT_EQ(failed.state(), v1::Job::STATE_FAILED);
  EXPECT_EQ(failed.error().code(), static_cast<int>(grpc::StatusCode::DATA_LOSS));
  EXPECT_THAT(failed.error().message(), HasSubstr("it broke"));
}

TEST_F(JobRpcTest, ColorizersAndServerInfo) {
  const std::string scene = client_->MakeScene().name();
  v1::JobSpec spec;
  spec.set_scene(scene);
  *spec.mutable_colorize_scene()->mutable_key_color()->mutable_image() = client_->Upload("key");
  const v1::Job root = client_->Create(spec);
  EXPECT_EQ(Work(), 12) << "all but the augmentations";
  EXPECT_EQ(client_->Get(root.name()).state(), v1::Job::STATE_SUCCEEDED);
  v1::ListColorizersRequest list;
  list.set_scene(scene);
  v1::ListColorizersResponse colorizers;
  grpc::ClientContext context1;
  ASSERT_TRUE(client_->colorizers->ListColorizers(&context1, list, &colorizers).ok());
  ASSERT_EQ(colorizers.colorizers_size(), 1);
  v1::GetColorizerRequest get;
  get.set_name(colorizers.colorizers(0).name());
  v1::Colorizer colorizer;
  grpc::ClientContext context2;
  ASSERT_TRUE(client_->colorizers->GetColorizer(&context2, get, &colorizer).ok());
  EXPECT_EQ(colorizer.scene(), scene);
  grpc::ClientContext context3;
  auto stream = client_->colorizers->ColorizeImages(&context3);
  EXPECT_EQ(ReasonOfStatus(stream->Finish()), "NO_INFERENCE_WORKER");
  v1::ServerInfo info;
  grpc::ClientContext context4;
  ASSERT_TRUE(client_->server->GetServerInfo(&context4, {}, &info).ok());
  EXPECT_GT(info.memory_bytes(), 0);
  EXPECT_EQ(info.limits().max_unfinished_jobs(), 40);
  EXPECT_EQ(info.job_kinds_size(), 14);
  ASSERT_EQ(info.presets_size(), 3);
  EXPECT_EQ(info.presets(0).name(), "fast");
  EXPECT_EQ(info.presets(0).options().personalize().iterations(), 300);
}

}  // namespace
}  // namespace color3d::testing
