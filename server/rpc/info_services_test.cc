#include <gtest/gtest.h>

#include "tests/support/service/rpc_fixture.h"

namespace color3d::testing {
namespace {
using InfoServicesTest = RpcTest;

TEST_F(InfoServicesTest, ListsColorizersAndServerInfo) {
  const std::string scene = client_->MakeScene().name();
  v1::JobSpec spec;
  spec.set_scene(scene);
  *spec.mutable_colorize_scene()->mutable_key_color()->mutable_image() = client_->Upload("key");
  const v1::Job root = client_->Create(spec);
  EXPECT_EQ(Work(), 12) << "all jobs except the augmentations";
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
  EXPECT_EQ(info.job_kinds_size(), 15);
  ASSERT_EQ(info.presets_size(), 3);
  EXPECT_EQ(info.presets(0).name(), "fast");
  EXPECT_EQ(info.presets(0).options().personalize().iterations(), 100);
}

TEST_F(InfoServicesTest, ServerInfoDescribesWorkers) {
  WorkerRecord worker{"w", 7, "", 5, 0};
  worker.machine = "node7";
  worker.release = "1.2.3";
  worker.threads = 8;
  worker.memory_limit_bytes = 6;
  worker.simd = "avx2";
  worker.cache_bytes = 1;
  worker.cache_limit_bytes = 2;
  worker.cache_hit_bytes = 3;
  worker.cache_miss_bytes = 4;
  worker.finished_jobs = 9;
  store_.UpdateWorker(worker);
  v1::ServerInfo info;
  grpc::ClientContext context;
  ASSERT_TRUE(client_->server->GetServerInfo(&context, {}, &info).ok());
  ASSERT_EQ(info.workers_size(), 1);
  const v1::WorkerInfo& entry = info.workers(0);
  EXPECT_EQ(entry.machine(), "node7");
  EXPECT_EQ(entry.release(), "1.2.3");
  EXPECT_EQ(entry.threads(), 8);
  EXPECT_EQ(entry.memory_limit_bytes(), 6);
  EXPECT_EQ(entry.simd(), "avx2");
  EXPECT_EQ(entry.cache_bytes(), 1);
  EXPECT_EQ(entry.cache_limit_bytes(), 2);
  EXPECT_EQ(entry.cache_hit_bytes(), 3);
  EXPECT_EQ(entry.cache_miss_bytes(), 4);
  EXPECT_EQ(entry.finished_jobs(), 9);
}

TEST_F(InfoServicesTest, QueueListsJobsWithWhatTheyNeed) {
  const std::string scene = client_->MakeScene().name();
  v1::CreateJobRequest request;
  request.mutable_spec()->set_scene(scene);
  *request.mutable_spec()->mutable_colorize_scene()->mutable_key_color()->mutable_image() =
      client_->Upload("key");
  request.set_priority(7);
  request.mutable_deadline()->set_seconds(2'000'000'000);
  const auto create = [&](v1::Job* job) {
    grpc::ClientContext context;
    return client_->jobs->CreateJob(&context, request, job);
  };
  v1::Job root;
  ASSERT_TRUE(create(&root).ok());
  EXPECT_EQ(root.deadline().seconds(), 2'000'000'000);
  const auto list = [&](int waiting, v1::ListQueueResponse* queue) {
    v1::ListQueueRequest query;
    query.set_max_waiting_jobs(waiting);
    grpc::ClientContext context;
    return client_->admin->ListQueue(&context, query, queue);
  };
  v1::ListQueueResponse queue;
  ASSERT_TRUE(list(0, &queue).ok());
  ASSERT_EQ(queue.jobs_size(), 1);
  EXPECT_EQ(queue.waiting_jobs(), 1);
  EXPECT_GT(queue.blocked_jobs(), 5);
  EXPECT_EQ(queue.jobs(0).kind(), "import_scene");
  EXPECT_EQ(queue.jobs(0).parent(), root.name());
  EXPECT_EQ(queue.jobs(0).priority(), 7);
  EXPECT_EQ(queue.jobs(0).state(), v1::Job::STATE_QUEUED);
  EXPECT_GT(queue.jobs(0).memory_bytes(), 100 << 20) << "from the plan";
  EXPECT_EQ(queue.jobs(0).deadline().seconds(), 2'000'000'000);
  EXPECT_EQ(queue.jobs(0).waits_for(), "a worker; none is running");
  ASSERT_TRUE(store_.Claim("w", 60'000));
  ASSERT_TRUE(list(10, &queue).ok());
  EXPECT_EQ(queue.jobs(0).state(), v1::Job::STATE_RUNNING);
  EXPECT_EQ(queue.jobs(0).worker().substr(0, 1), "w");
  EXPECT_EQ(list(-1, &queue).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(list(1001, &queue).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  for (const int64_t wrong : {int64_t{-1}, int64_t{0}, int64_t{1} << 40}) {
    request.mutable_deadline()->set_seconds(wrong);
    EXPECT_EQ(create(&root).error_code(), grpc::StatusCode::INVALID_ARGUMENT) << wrong;
  }
}

TEST_F(InfoServicesTest, WeightOfProjectIsChecked) {
  const auto set = [&](const std::string& project, int weight) {
    v1::SetProjectWeightRequest request;
    request.set_project(project);
    request.set_weight(weight);
    v1::ProjectUsage usage;
    grpc::ClientContext context;
    const grpc::Status status = client_->admin->SetProjectWeight(&context, request, &usage);
    return status.ok() ? usage.weight() : -static_cast<int>(status.error_code());
  };
  const int kInvalid = -static_cast<int>(grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(set("lab", 3), 3);
  EXPECT_EQ(store_.GetProject("lab").weight, 3);
  EXPECT_EQ(set("", 100), 100);
  EXPECT_EQ(set("lab", 0), kInvalid);
  EXPECT_EQ(set("lab", 101), kInvalid);
  EXPECT_EQ(set("No Name", 2), kInvalid);
}

}  // namespace
}  // namespace color3d::testing
