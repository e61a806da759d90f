// Two projects on one server: no call reveals or changes data of the other project.
#include <gtest/gtest.h>

#include <deque>
#include <thread>
#include <utility>

#include "tests/support/service/projects_fixture.h"

namespace color3d::testing {
namespace {
using grpc::StatusCode;

TEST_F(ProjectsTest, HidesDataOfOtherProject) {
  const std::string scene = attic_->MakeScene().name();
  v1::JobSpec spec;
  spec.set_scene(scene);
  *spec.mutable_colorize_scene()->mutable_key_color()->mutable_image() = attic_->Upload("key");
  const v1::Job job = attic_->Create(spec);
  EXPECT_EQ(Work(), 12);
  const v1::Digest result = attic_->Get(job.name()).artifacts(0).digest();
  EXPECT_EQ(attic_->Download(result).size(), static_cast<size_t>(result.size_bytes()));
  v1::ListColorizersResponse colorizers;
  Call(*attic_->colorizers,
       &v1::ColorizerService::Stub::ListColorizers,
       v1::ListColorizersRequest(),
       &colorizers);
  ASSERT_EQ(colorizers.colorizers_size(), 1);
  EXPECT_EQ(colorizers.colorizers(0).scene(), scene);

  TestClient& other = *cellar_;
  const auto not_found = [](const grpc::Status& status) {
    EXPECT_EQ(status.error_code(), StatusCode::NOT_FOUND) << status.error_message();
  };
  using Scenes = v1::SceneService::Stub;
  using Jobs = v1::JobService::Stub;
  not_found(Call(*other.scenes, &Scenes::GetScene, Named<v1::GetSceneRequest>(scene)));
  not_found(Call(*other.scenes, &Scenes::CommitScene, Named<v1::CommitSceneRequest>(scene)));
  not_found(Call(*other.scenes, &Scenes::AcceptKeyColor, Named<v1::AcceptKeyColorRequest>(scene)));
  not_found(Call(*other.scenes, &Scenes::DeleteScene, Named<v1::DeleteSceneRequest>(scene)));
  not_found(Call(*other.jobs, &Jobs::GetJob, Named<v1::GetJobRequest>(job.name())));
  not_found(Call(*other.jobs, &Jobs::CancelJob, Named<v1::CancelJobRequest>(job.name())));
  not_found(Call(*other.jobs, &Jobs::RetryJob, Named<v1::RetryJobRequest>(job.name())));
  not_found(Call(*other.jobs, &Jobs::DeleteJob, Named<v1::DeleteJobRequest>(job.name())));
  not_found(Call(*other.jobs, &Jobs::PinJob, Named<v1::PinJobRequest>(job.name())));
  v1::CreateJobRequest create;
  *create.mutable_spec() = ScriptedSpec(scene, "a");
  not_found(Call(*other.jobs, &Jobs::CreateJob, create));
  not_found(Call(*other.colorizers,
                 &v1::ColorizerService::Stub::GetColorizer,
                 Named<v1::GetColorizerRequest>(colorizers.colorizers(0).name())));
  {
    grpc::ClientContext context;
    v1::WatchJobsRequest watch;
    watch.add_names(job.name());
    v1::JobEvent event;
    auto stream = other.jobs->WatchJobs(&context, watch);
    EXPECT_FALSE(stream->Read(&event));
    not_found(stream->Finish());
  }
  {
    grpc::ClientContext context;
    v1::JobLogChunk chunk;
    auto stream = other.jobs->ReadJobLog(&context, Named<v1::ReadJobLogRequest>(job.name()));
    EXPECT_FALSE(stream->Read(&chunk));
    not_found(stream->Finish());
  }
  EXPECT_THROW(other.Download(result), std::runtime_error);
  v1::FindMissingBlobsRequest find;
  *find.add_digests() = result;
  *find.add_digests() = DigestOf("key");
  v1::FindMissingBlobsResponse missing;
  Call(*other.blobs, &v1::BlobService::Stub::FindMissingBlobs, find, &missing);
  EXPECT_EQ(missing.missing_size(), 2) << "must not reveal that another project has them";
  google::bytestream::QueryWriteStatusRequest query;
  query.set_resource_name("uploads/u1/blobs/" + DigestOf("key").sha256() + "/3");
  google::bytestream::QueryWriteStatusResponse written;
  Call(*other.bytes, &google::bytestream::ByteStream::Stub::QueryWriteStatus, query, &written);
  EXPECT_FALSE(written.complete());

  v1::ListScenesResponse scenes;
  Call(*other.scenes, &Scenes::ListScenes, v1::ListScenesRequest(), &scenes);
  EXPECT_EQ(scenes.scenes_size(), 0);
  v1::ListJobsResponse jobs;
  for (const std::string& parent : {std::string(), scene, job.name()}) {
    v1::ListJobsRequest list;
    list.set_parent(parent);
    Call(*other.jobs, &Jobs::ListJobs, list, &jobs);
    EXPECT_EQ(jobs.jobs_size(), 0) << parent;
  }
  EXPECT_EQ(other.Download(other.Upload("key")), "key")
      << "a project that uploads the bytes has them";
}

// Requests cannot name jobs, scenes or files of the other project as inputs either.
TEST_F(ProjectsTest, RefusesInputsOfOtherProject) {
  const std::string scene = attic_->MakeScene().name(), own = cellar_->MakeScene().name();
  v1::JobSpec spec;
  spec.set_scene(scene);
  *spec.mutable_colorize_scene()->mutable_key_color()->mutable_image() = attic_->Upload("key");
  const v1::Job job = attic_->Create(spec);
  Work();
  v1::Job key_color;
  for (const v1::Job& child : attic_->Children(job.name())) {
    if (child.kind() == "colorize_key_view") key_color = child;
  }
  v1::ListColorizersResponse colorizers;
  Call(*attic_->colorizers,
       &v1::ColorizerService::Stub::ListColorizers,
       v1::ListColorizersRequest(),
       &colorizers);
  ASSERT_EQ(colorizers.colorizers_size(), 1);

  const auto create = [&](const v1::JobSpec& wanted) {
    v1::CreateJobRequest request;
    *request.mutable_spec() = wanted;
    return Call(*cellar_->jobs, &v1::JobService::Stub::CreateJob, request);
  };
  v1::JobSpec inputs = ScriptedSpec(own, "a");
  inputs.add_inputs(job.name());
  EXPECT_EQ(create(inputs).error_code(), StatusCode::NOT_FOUND);
  v1::JobSpec digests = spec;
  digests.set_scene(own);
  EXPECT_EQ(ReasonOfStatus(create(digests)), "BLOB_MISSING");
  for (const bool of_scene : {true, false}) {
    v1::JobSpec routes;
    auto* route = routes.mutable_personalize_scenes()->add_routes();
    route->set_scene(of_scene ? scene : own);
    route->set_key_color_job(key_color.name());
    EXPECT_EQ(create(routes).error_code(), StatusCode::NOT_FOUND) << of_scene;
  }

  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
  const auto stream = cellar_->colorizers->ColorizeImages(&context);
  std::vector<v1::ColorizeImagesRequest> pictures(4);
  pictures[0].set_scene(scene);
  pictures[1].set_colorizer(colorizers.colorizers(0).name());
  *pictures[2].mutable_example() = DigestOf("key");
  *pictures[3].mutable_image_digest() = DigestOf("key");
  *pictures[3].mutable_example() = cellar_->Upload("an example");
  for (size_t i = 0; i < pictures.size(); ++i) {
    if (i != 3) pictures[i].set_image("picture");
    pictures[i].set_request_id(std::to_string(i));
    stream->Write(pictures[i]);
    v1::ColorizeImagesResponse answer;
    ASSERT_TRUE(stream->Read(&answer)) << i;
    EXPECT_EQ(answer.request_id(), std::to_string(i));
    EXPECT_EQ(answer.error().code(), static_cast<int>(StatusCode::NOT_FOUND))
        << i << ": " << answer.error().message();
  }
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
}

// Callers without the right to write are refused before their first byte is read.
TEST_F(ProjectsTest, RefusesUploadsBeforeFirstByte) {
  std::deque<grpc::ClientContext> contexts;
  google::bytestream::WriteResponse response;
  const auto write = [&](TestClient& client) {
    grpc::ClientContext& context = contexts.emplace_back();
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
    return client.bytes->Write(&context, &response);
  };
  EXPECT_EQ(ReasonOfStatus(write(*Open("no such token"))->Finish()), "TOKEN_UNKNOWN");
  const auto first = write(*attic_), second = write(*attic_);
  for (int i = 0; i < 500 && guarded_->open().uploads < 2; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(ReasonOfStatus(write(*attic_)->Finish()), "QUOTA_EXCEEDED");
  for (grpc::ClientContext& context : contexts) context.TryCancel();
  first->Finish();
  second->Finish();
}

TEST_F(ProjectsTest, AdminPausesKillsAndCollects) {
  using Admin = v1::AdminService::Stub;
  const v1::Job job = attic_->Create(ScriptedSpec(attic_->MakeScene().name(), "a"));
  ASSERT_TRUE(Call(*admin_->admin, &Admin::PauseQueue, v1::PauseQueueRequest()).ok());
  EXPECT_EQ(Work(), 0);
  EXPECT_NE(attic_->Get(job.name()).waits_for().find("paused"), std::string::npos);
  EXPECT_GT(attic_->Get(job.name()).queue_position(), 0);
  ASSERT_TRUE(Call(*admin_->admin, &Admin::ResumeQueue, v1::ResumeQueueRequest()).ok());
  v1::Job killed;
  ASSERT_TRUE(
      Call(*admin_->admin, &Admin::KillJob, Named<v1::KillJobRequest>(job.name()), &killed).ok());
  EXPECT_EQ(killed.state(), v1::Job::STATE_CANCELLED);
  EXPECT_EQ(attic_->Get(job.name()).state(), v1::Job::STATE_CANCELLED);
  v1::CollectRequest collect;
  collect.set_grace_seconds(60);
  EXPECT_EQ(Call(*admin_->admin, &Admin::Collect, collect).error_code(),
            StatusCode::INVALID_ARGUMENT);
  collect.clear_grace_seconds();
  collect.set_dry_run(true);
  v1::CollectResponse collected;
  ASSERT_TRUE(Call(*admin_->admin, &Admin::Collect, collect, &collected).ok());
  EXPECT_EQ(collected.blobs(), 0);
}

TEST_F(ProjectsTest, AdminDrainsServer) {
  EXPECT_FALSE(asked_to_drain_);
  ASSERT_TRUE(Call(*admin_->admin, &v1::AdminService::Stub::Drain, v1::DrainRequest()).ok());
  EXPECT_TRUE(asked_to_drain_);
}

}  // namespace
}  // namespace color3d::testing
