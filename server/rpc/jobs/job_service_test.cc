#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {
using ::testing::HasSubstr;
using JobServiceTest = RpcTest;

TEST_F(JobServiceTest, RequestIdIsIdempotentAndBoundToRequest) {
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

TEST_F(JobServiceTest, RefusesBadJobs) {
  const std::string scene = client_->MakeScene().name();
  v1::JobSpec spec;
  spec.set_scene(scene);
  grpc::Status status = CreateStatus(spec);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("spec has no stage"));
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

TEST_F(JobServiceTest, FullQueueGivesRetryDelay) {
  const std::string scene = client_->MakeScene().name();
  grpc::Status status;
  for (int i = 0; i < 30 && status.ok(); ++i) {
    status = CreateStatus(ScriptedSpec(scene, "steps=1", i + 1));
  }
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOfStatus(status), "QUEUE_FULL");
  EXPECT_TRUE(HasRetryInfo(status));
}

TEST_F(JobServiceTest, PagesLists) {
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

TEST_F(JobServiceTest, BoundsBytesOfPage) {
  const std::string scene = client_->MakeScene().name();
  NewGraph graph;
  graph.scene = scene;
  graph.jobs.resize(1);
  graph.jobs[0].kind = kind::kImportScene;
  v1::JobSpec spec = ScriptedSpec(scene, std::string(60'000, 's'));
  graph.jobs[0].spec = spec.SerializeAsString();
  for (int i = 0; i < 30; ++i) store_.CreateGraph(graph, {}, 1000);
  // Specs of this size were accepted by older releases.
  spec = ScriptedSpec(scene, std::string(7 << 20, 's'));
  graph.jobs[0].spec = spec.SerializeAsString();
  const std::string old = store_.CreateGraph(graph, {}, 1000).name;
  std::set<std::string> names;
  v1::ListJobsRequest request;
  request.set_page_size(1000);
  int pages = 0;
  do {
    grpc::ClientContext context;
    v1::ListJobsResponse response;
    const grpc::Status status = client_->jobs->ListJobs(&context, request, &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_LT(response.ByteSizeLong(), (1u << 20) + (100u << 10));
    for (const v1::Job& job : response.jobs()) {
      EXPECT_TRUE(names.insert(job.name()).second);
      EXPECT_EQ(job.has_spec() && job.spec().has_select_key_view(), job.name() != old);
    }
    request.set_page_token(response.next_page_token());
    ++pages;
  } while (!request.page_token().empty() && pages < 20);
  EXPECT_EQ(names.size(), 31u);
  EXPECT_GE(pages, 2);

  // A watch is bounded, too.
  v1::WatchJobsRequest watch;
  watch.add_names(old);
  grpc::ClientContext context;
  const auto stream = client_->jobs->WatchJobs(&context, watch);
  v1::JobEvent event;
  ASSERT_TRUE(stream->Read(&event));
  EXPECT_EQ(event.job().name(), old);
  context.TryCancel();
}

TEST_F(JobServiceTest, RefusesLongSpecs) {
  const std::string scene = client_->MakeScene().name();
  v1::JobSpec spec;
  spec.set_scene(scene);
  for (int i = 0; i < 20; ++i) spec.mutable_render()->add_views(std::string(4000, 'v'));
  grpc::Status status = CreateStatus(spec);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("at most 65536 are allowed"));
  spec.mutable_render()->clear_views();
  spec.mutable_render()->add_views("a");
  spec.mutable_render()->add_views(std::string(5000, 'v'));
  status = CreateStatus(spec);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("render.views[1] has 5000 bytes"));
}

TEST_F(JobServiceTest, CancelsRetriesAndDeletes) {
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

TEST_F(JobServiceTest, DrainingRefusesJobsAndEndsStreams) {
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
  EXPECT_EQ(client_->Get(name).name(), name) << "reads are still answered";
}

TEST_F(JobServiceTest, FailedJobCarriesError) {
  const std::string scene = client_->MakeScene().name();
  const std::string name = client_->Create(ScriptedSpec(scene, "steps=1")).name();
  const auto job = store_.Claim("w", 60'000);
  store_.Fail({job->id, job->lease_epoch}, {ErrorCode::kDataLoss, "BROKEN", "it broke"}, {});
  const v1::Job failed = client_->Get(name);
  EXPECT_EQ(failed.state(), v1::Job::STATE_FAILED);
  EXPECT_EQ(failed.error().code(), static_cast<int>(grpc::StatusCode::DATA_LOSS));
  EXPECT_THAT(failed.error().message(), HasSubstr("it broke"));
}

}  // namespace
}  // namespace color3d::testing
