// Two projects on one server: no call of the one tells or touches what the other has.
#include <gtest/gtest.h>

#include <deque>
#include <thread>
#include <utility>

#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {
using grpc::StatusCode;

class ProjectsTest : public RpcTest {
 protected:
  ProjectsTest() {
    const auto file = scratch_.path() / "tokens";
    const std::string attic = AddToken(file, "anna", Role::kSubmit, "attic");
    const std::string cellar = AddToken(file, "carl", Role::kSubmit, "cellar");
    const std::string admin = AddToken(file, "root", Role::kAdmin);
    RpcServerOptions options;
    options.listen = "unix:" + (scratch_.path() / "socket").string();
    options.credentials = grpc::experimental::LocalServerCredentials(UDS);
    options.tokens = std::make_shared<TokenBook>(file);
    options.limits.project_max_stored_bytes = 200'000;
    options.limits.project_max_scenes = 3;
    options.limits.project_max_unfinished_jobs = 20;
    options.limits.project_max_streams = 2;
    options.job_logs = scratch_.path();
    options.inference.target = "unix:" + (scratch_.path() / "nobody").string();
    guarded_ = std::make_unique<RpcServer>(options, store_, blobs_, uploads_, SystemClock());
    attic_ = Open(attic);
    cellar_ = Open(cellar);
    admin_ = Open(admin);
  }
  std::unique_ptr<TestClient> Open(const std::string& token) const {
    return std::make_unique<TestClient>(grpc::CreateChannel(
        guarded_->address(),
        grpc::CompositeChannelCredentials(grpc::experimental::LocalCredentials(UDS),
                                          grpc::AccessTokenCredentials(token))));
  }
  template <typename Stub, typename Request, typename Response>
  static grpc::Status Call(Stub& stub,
                           grpc::Status (Stub::*method)(grpc::ClientContext*,
                                                        const Request&,
                                                        Response*),
                           const Request& request,
                           Response* response = nullptr) {
    grpc::ClientContext context;
    Response ignored;
    return (stub.*method)(&context, request, response != nullptr ? response : &ignored);
  }
  template <typename Request>
  static Request Named(const std::string& name) {
    Request request;
    request.set_name(name);
    return request;
  }

  std::unique_ptr<RpcServer> guarded_;
  std::unique_ptr<TestClient> attic_, cellar_, admin_;
};

TEST_F(ProjectsTest, WhatOneHasIsNotThereForTheOther) {
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
  EXPECT_EQ(missing.missing_size(), 2) << "it must not tell that somebody has them";
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
  EXPECT_EQ(other.Download(other.Upload("key")), "key") << "whoever shows the bytes has them";
}

// Jobs, scenes and files of others in what a request names, not in what it asks for.
TEST_F(ProjectsTest, WhatOneHasCannotBeNamedByTheOther) {
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

TEST_F(ProjectsTest, QuotasSayWhatIsFullAndWhenToTryAgain) {
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
  cellar_->Upload(more);  // another's quota is his

  v1::ServerInfo info;
  Call(*attic_->server, &v1::ServerService::Stub::GetServerInfo, v1::GetServerInfoRequest(), &info);
  EXPECT_EQ(info.project(), "attic");
  EXPECT_EQ(info.role(), "submit");
  EXPECT_EQ(info.usage().stored_bytes(), 180'000 + 4096) << "with what the file takes besides";
  EXPECT_EQ(info.usage().max_stored_bytes(), 200'000);
  v1::ListProjectsResponse projects;
  ASSERT_TRUE(Call(*admin_->admin,
                   &v1::AdminService::Stub::ListProjects,
                   v1::ListProjectsRequest(),
                   &projects)
                  .ok());
  EXPECT_EQ(projects.projects_size(), 2);
}

TEST_F(ProjectsTest, UploadsSideBySideShareTheQuota) {
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
  cellar_->Upload(std::string(120'000, 'c'));  // its quota is its own
  contexts[0].TryCancel();
  first->Finish();
}

TEST_F(ProjectsTest, NothingIsRetriedBeyondTheQuotaOrOnAFullDisk) {
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
  EXPECT_EQ(reason(), "") << "the same call, made before";
}

// A scene of long paths and a job of a long spec take space in the database.
TEST_F(ProjectsTest, RowsCountInTheQuota) {
  v1::CreateSceneRequest create;
  for (int i = 0; i < 130; ++i) {
    v1::SceneFile* file = create.add_files();
    file->set_path(std::to_string(i) + "/" + std::string(250, 'x') + "/" + std::string(250, 'y'));
    *file->mutable_digest() = DigestOf("a");
  }
  const auto reason = [&](TestClient& client) {
    return ReasonOfStatus(
        Call(*client.scenes, &v1::SceneService::Stub::CreateScene, create));
  };
  EXPECT_EQ(reason(*attic_), "");
  EXPECT_EQ(reason(*attic_), "");
  const grpc::Status refused =
      Call(*attic_->scenes, &v1::SceneService::Stub::CreateScene, create);
  EXPECT_EQ(ReasonOfStatus(refused), "QUOTA_EXCEEDED") << "twice 90 kB are there";
  EXPECT_NE(refused.error_message().find("rows"), std::string::npos);
  EXPECT_EQ(reason(*cellar_), "") << "another's quota is his";

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
    Call(*cellar_->jobs, &v1::JobService::Stub::CancelJob, Named<v1::CancelJobRequest>(created.name()));
  }
  EXPECT_EQ(ReasonOfStatus(status), "QUOTA_EXCEEDED") << made << " jobs";
  EXPECT_LT(made, 20);
}

TEST_F(ProjectsTest, ScenesOfAProjectAreCounted) {
  v1::CreateSceneRequest create;
  v1::SceneFile* file = create.add_files();
  file->set_path("a.png");
  *file->mutable_digest() = DigestOf("a");
  const auto reason = [&](TestClient& client) {
    return ReasonOfStatus(
        Call(*client.scenes, &v1::SceneService::Stub::CreateScene, create));
  };
  for (int i = 0; i < 3; ++i) EXPECT_EQ(reason(*attic_), "");
  EXPECT_EQ(reason(*attic_), "QUOTA_EXCEEDED");
  EXPECT_EQ(reason(*cellar_), "");
}

TEST_F(ProjectsTest, StreamsOfAProjectAreCounted) {
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

TEST_F(ProjectsTest, LiveStreamsOfAProjectAreCounted) {
  std::deque<grpc::ClientContext> contexts;
  v1::ColorizeImagesResponse response;
  // Whether the stream is open: a picture that is none gets an answer.
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

// Of whoever may not write nothing is read; he hears so before he has sent a byte.
TEST_F(ProjectsTest, UploadsAreRefusedBeforeTheyBegin) {
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

TEST_F(ProjectsTest, WhoRunsTheServerPausesKillsAndCollects) {
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

TEST_F(RpcTest, JobsAndScenesAreNotAcceptedOnADiskThatIsNearlyFull) {
  const std::string scene = client_->MakeScene().name();
  store_.SetHold(Hold::kStorage, true);
  v1::Scene made;
  EXPECT_EQ(ReasonOfStatus(Commit({{"a.png", TinyPng()}}, &made)), "STORAGE_FULL");
  const grpc::Status refused = CreateStatus(ScriptedSpec(scene, "a"));
  EXPECT_EQ(ReasonOfStatus(refused), "STORAGE_FULL");
  EXPECT_TRUE(HasRetryInfo(refused));
  store_.SetHold(Hold::kStorage, false);
  EXPECT_TRUE(CreateStatus(ScriptedSpec(scene, "a")).ok());
}

// What was found some seconds ago is not believed: a few large calls fill a disk in less.
TEST_F(RpcTest, BelowLowSpaceNothingIsCreatedFromTheFirstCallOn) {
  const std::string scene = client_->MakeScene().name();
  RpcServerOptions options;
  options.listen = "127.0.0.1:0";
  options.limits.low_space_bytes = int64_t{1} << 60;
  RpcServer full(options, store_, blobs_, uploads_, SystemClock());
  TestClient client(full.address());
  v1::CreateSceneRequest create;
  v1::SceneFile* file = create.add_files();
  file->set_path("a.png");
  *file->mutable_digest() = DigestOf("a");
  v1::Scene made;
  grpc::ClientContext first, second, third;
  EXPECT_EQ(ReasonOfStatus(client.scenes->CreateScene(&first, create, &made)), "STORAGE_FULL");
  v1::CreateJobRequest job;
  *job.mutable_spec() = ScriptedSpec(scene, "a");
  v1::Job created;
  EXPECT_EQ(ReasonOfStatus(client.jobs->CreateJob(&second, job, &created)), "STORAGE_FULL");
  v1::DeleteSceneRequest remove;
  remove.set_name(scene);
  v1::DeleteSceneResponse removed;
  EXPECT_TRUE(client.scenes->DeleteScene(&third, remove, &removed).ok());
}

}  // namespace
}  // namespace color3d::testing
