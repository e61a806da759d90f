// Fixture of the RPC tests: all services over a real port. The test acts as worker through the job
// store.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/files.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/stages.h"
#include "server/rpc/rpc_server.h"
#include "server/storage/file_blob_store.h"
#include "tests/support/service/rpc_support.h"
#include "tests/support/service/test_store.h"

namespace color3d::testing {

constexpr int kMaxWatches = 60;
constexpr char kUuid[] = "3f0c9a52-7e4b-4c1d-9b1e-2f6d8a7c5b40";

class RpcTest : public ::testing::Test {
 protected:
  explicit RpcTest(int64_t max_blob_bytes = 1 << 20)
      : uploads_(scratch_.path() / "uploads", blobs_, max_blob_bytes) {
    RpcServerOptions options;
    options.listen = "127.0.0.1:0";
    options.watch.poll = std::chrono::milliseconds(10);
    options.watch.keepalive = std::chrono::milliseconds(300);
    options.limits.max_unfinished_jobs = 40;
    options.limits.max_watches = kMaxWatches;
    options.job_logs = MakeFileJobLogs(scratch_.path());
    server_ = std::make_unique<RpcServer>(options, store_, blobs_, uploads_, SystemClock());
    client_ = std::make_unique<TestClient>(server_->address());
  }

  // Runs all queued jobs; returns their number.
  int Work() {
    int done = 0;
    while (const auto job = store_.Claim("test-worker", 60'000)) {
      Publication publication;
      publication.artifacts = {{job->kind + ".txt", blobs_.PutBytes(job->name), "text/plain"}};
      if (job->kind == kind::kPersonalize) publication.artifacts[0].name = artifact::kColorizer;
      store_.Publish({job->id, job->lease_epoch}, publication);
      ++done;
    }
    return done;
  }
  grpc::Status CreateStatus(const v1::JobSpec& spec, const std::string& request_id = "") {
    v1::CreateJobRequest request;
    *request.mutable_spec() = spec;
    request.set_request_id(request_id);
    grpc::ClientContext context;
    v1::Job job;
    return client_->jobs->CreateJob(&context, request, &job);
  }
  grpc::Status WriteAt(const std::string& resource,
                       int64_t offset,
                       const std::string& data,
                       bool finish,
                       int64_t* committed = nullptr) {
    grpc::ClientContext context;
    google::bytestream::WriteResponse response;
    auto stream = client_->bytes->Write(&context, &response);
    google::bytestream::WriteRequest request;
    request.set_resource_name(resource);
    request.set_write_offset(offset);
    request.set_data(data);
    request.set_finish_write(finish);
    stream->Write(request);
    stream->WritesDone();
    const grpc::Status status = stream->Finish();
    if (committed != nullptr) *committed = response.committed_size();
    return status;
  }
  grpc::Status Commit(const std::vector<std::pair<std::string, std::string>>& files,
                      v1::Scene* scene) {
    v1::CreateSceneRequest create;
    for (const auto& [path, content] : files) {
      v1::SceneFile* file = create.add_files();
      file->set_path(path);
      *file->mutable_digest() = DigestOf(content);
      if (content != "missing") client_->Upload(content);
    }
    grpc::ClientContext create_context;
    const grpc::Status created = client_->scenes->CreateScene(&create_context, create, scene);
    if (!created.ok()) return created;
    v1::CommitSceneRequest commit;
    commit.set_name(scene->name());
    grpc::ClientContext context;
    return client_->scenes->CommitScene(&context, commit, scene);
  }

  ScratchFolder scratch_;
  FileBlobStore blobs_{scratch_.path() / "blobs", {0}};
  UploadStore uploads_;
  std::unique_ptr<JobStore> opened_ = OpenTestStore(scratch_.path() / "jobs.db");
  JobStore& store_ = *opened_;
  std::unique_ptr<RpcServer> server_;
  std::unique_ptr<TestClient> client_;
};

}  // namespace color3d::testing
