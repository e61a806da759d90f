// Quotas of two projects.
#include <gtest/gtest.h>

#include <deque>
#include <thread>
#include <utility>

#include "tests/support/service/projects_fixture.h"

namespace color3d::testing {
namespace {
using grpc::StatusCode;

TEST_F(ProjectsTest, QuotaErrorNamesQuotaAndRetryDelay) {
  attic_->Upload(std::string(180'000, 'a'));
  grpc::ClientContext context;
  google::bytestream::WriteResponse response;
  auto stream = attic_->bytes->Write(&context, &response);
  const std::string more(20'000, 'b');
  google::bytestream::WriteRequest request;
  request.set_resource_name("uploads/u2/blobs/" + Sha256Hex(more) + "/20000");
  request.set_data(more);
  request.set_finish_write(true);
  stream->Write(request);
  stream->WritesDone();
  const grpc::Status refused = stream->Finish();
  EXPECT_EQ(refused.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOfStatus(refused), "QUOTA_EXCEEDED");
  EXPECT_TRUE(HasRetryInfo(refused));
  google::rpc::Status details;
  ASSERT_TRUE(details.ParseFromString(refused.error_details()));
  google::rpc::QuotaFailure failure;
  bool found = false;
  for (const auto& any : details.details()) found = found || any.UnpackTo(&failure);
  ASSERT_TRUE(found);
  EXPECT_EQ(failure.violations(0).subject(), "project:attic stored_bytes");
  cellar_->Upload(more);  // the quota of the other project

  v1::ServerInfo info;
  Call(*attic_->server, &v1::ServerService::Stub::GetServerInfo, v1::GetServerInfoRequest(), &info);
  EXPECT_EQ(info.project(), "attic");
  EXPECT_EQ(info.role(), "submit");
  EXPECT_EQ(info.usage().stored_bytes(), 180'000 + 4096) << "the file and its overhead";
  EXPECT_EQ(info.usage().max_stored_bytes(), 200'000);
  v1::ListProjectsResponse projects;
  ASSERT_TRUE(Call(*admin_->admin,
                   &v1::AdminService::Stub::ListProjects,
                   v1::ListProjectsRequest(),
                   &projects)
                  .ok());
  EXPECT_EQ(projects.projects_size(), 2);
}

TEST_F(ProjectsTest, ParallelUploadsShareQuota) {
  std::deque<grpc::ClientContext> contexts;
  google::bytestream::WriteResponse responses[2];
  const auto write = [&](const char* uuid) {
    google::bytestream::WriteResponse* response = &responses[contexts.size()];
    grpc::ClientContext& context = contexts.emplace_back();
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
    auto stream = attic_->bytes->Write(&context, response);
    const std::string content(120'000, uuid[0]);
    google::bytestream::WriteRequest request;
    request.set_resource_name("uploads/" + std::string(uuid) + "/blobs/" + Sha256Hex(content) +
                              "/120000");
    request.set_data(content.substr(0, 1000));
    stream->Write(request);
    return stream;
  };
  const auto first = write("a");
  for (int i = 0; i < 500 && std::filesystem::is_empty(scratch_.path() / "uploads"); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(ReasonOfStatus(write("b")->Finish()), "QUOTA_EXCEEDED");
  cellar_->Upload(std::string(120'000, 'c'));  // its own quota
  contexts[0].TryCancel();
  first->Finish();
}

TEST_F(ProjectsTest, RetryIsRefusedBeyondQuotaOrOnFullDisk) {
  const v1::Job job = attic_->Create(ScriptedSpec(attic_->MakeScene().name(), "a"));
  v1::RetryJobRequest retry = Named<v1::RetryJobRequest>(job.name());
  Call(*attic_->jobs, &v1::JobService::Stub::CancelJob, Named<v1::CancelJobRequest>(job.name()));
  const auto reason = [&] {
    return ReasonOfStatus(Call(*attic_->jobs, &v1::JobService::Stub::RetryJob, retry));
  };
  store_.SetHold(Hold::kStorage, true);
  EXPECT_EQ(reason(), "STORAGE_FULL");
  store_.SetHold(Hold::kStorage, false);
  store_.HoldBlob("attic", {Sha256Hex("much"), 300'000});
  EXPECT_EQ(reason(), "QUOTA_EXCEEDED");
  store_.ForgetBlob(Sha256Hex("much"));
  retry.set_request_id(kUuid);
  EXPECT_EQ(reason(), "");
  store_.SetHold(Hold::kStorage, true);
  EXPECT_EQ(reason(), "") << "repeated call with the same request_id";
}

// The paths of a scene and the spec of a job take space in the database.
TEST_F(ProjectsTest, RowsCountTowardsQuota) {
  v1::CreateSceneRequest create;
  for (int i = 0; i < 130; ++i) {
    v1::SceneFile* file = create.add_files();
    file->set_path(std::to_string(i) + "/" + std::string(250, 'x') + "/" + std::string(250, 'y'));
    *file->mutable_digest() = DigestOf("a");
  }
  const auto reason = [&](TestClient& client) {
    return ReasonOfStatus(Call(*client.scenes, &v1::SceneService::Stub::CreateScene, create));
  };
  EXPECT_EQ(reason(*attic_), "");
  EXPECT_EQ(reason(*attic_), "");
  const grpc::Status refused = Call(*attic_->scenes, &v1::SceneService::Stub::CreateScene, create);
  EXPECT_EQ(ReasonOfStatus(refused), "QUOTA_EXCEEDED") << "two scenes of 90 kB are stored";
  EXPECT_NE(refused.error_message().find("rows"), std::string::npos);
  EXPECT_EQ(reason(*cellar_), "") << "quota of the other project";

  const std::string scene = cellar_->MakeScene().name();
  v1::CreateJobRequest job;
  *job.mutable_spec() = ScriptedSpec(scene, std::string(4000, 's'));
  int made = 0;
  grpc::Status status;
  while (made < 100 && status.ok()) {
    v1::Job created;
    status = Call(*cellar_->jobs, &v1::JobService::Stub::CreateJob, job, &created);
    if (!status.ok()) break;
    ++made;
    Call(*cellar_->jobs,
         &v1::JobService::Stub::CancelJob,
         Named<v1::CancelJobRequest>(created.name()));
  }
  EXPECT_EQ(ReasonOfStatus(status), "QUOTA_EXCEEDED") << made << " jobs";
  EXPECT_LT(made, 20);
}

TEST_F(ProjectsTest, LimitsScenesOfProject) {
  v1::CreateSceneRequest create;
  v1::SceneFile* file = create.add_files();
  file->set_path("a.png");
  *file->mutable_digest() = DigestOf("a");
  const auto reason = [&](TestClient& client) {
    return ReasonOfStatus(Call(*client.scenes, &v1::SceneService::Stub::CreateScene, create));
  };
  for (int i = 0; i < 3; ++i) EXPECT_EQ(reason(*attic_), "");
  EXPECT_EQ(reason(*attic_), "QUOTA_EXCEEDED");
  EXPECT_EQ(reason(*cellar_), "");
}

TEST_F(ProjectsTest, LimitsStreamsOfProject) {
  const std::string scene = attic_->MakeScene().name();
  const v1::Job job = attic_->Create(ScriptedSpec(scene, "a"));
  v1::WatchJobsRequest watch;
  watch.add_names(job.name());
  grpc::ClientContext contexts[3];
  std::vector<std::unique_ptr<grpc::ClientReader<v1::JobEvent>>> streams;
  v1::JobEvent event;
  for (int i = 0; i < 2; ++i) {
    streams.push_back(attic_->jobs->WatchJobs(&contexts[i], watch));
    EXPECT_TRUE(streams.back()->Read(&event));
  }
  auto refused = attic_->jobs->WatchJobs(&contexts[2], watch);
  EXPECT_FALSE(refused->Read(&event));
  EXPECT_EQ(ReasonOfStatus(refused->Finish()), "QUOTA_EXCEEDED");
  for (int i = 0; i < 2; ++i) contexts[i].TryCancel();
  Work();
}

TEST_F(ProjectsTest, LimitsLiveStreamsOfProject) {
  std::deque<grpc::ClientContext> contexts;
  v1::ColorizeImagesResponse response;
  // Returns whether the stream is open: an open one answers a request that is not a picture.
  const auto open = [&](TestClient& client) {
    grpc::ClientContext& context = contexts.emplace_back();
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
    auto stream = client.colorizers->ColorizeImages(&context);
    stream->Write(v1::ColorizeImagesRequest());
    return std::pair(stream->Read(&response), std::move(stream));
  };
  const auto first = open(*attic_), second = open(*attic_), third = open(*attic_);
  EXPECT_TRUE(first.first);
  EXPECT_TRUE(second.first);
  EXPECT_FALSE(third.first);
  EXPECT_EQ(ReasonOfStatus(third.second->Finish()), "QUOTA_EXCEEDED");
  const auto others = open(*cellar_);
  EXPECT_TRUE(others.first);
  for (const auto* stream : {&first, &second, &others}) {
    stream->second->WritesDone();
    EXPECT_TRUE(stream->second->Finish().ok());
  }
}

}  // namespace
}  // namespace color3d::testing
