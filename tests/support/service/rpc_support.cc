#include "tests/support/service/rpc_support.h"

#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

#include "core/base/digest.h"

namespace color3d::testing {
namespace {

void Require(const grpc::Status& status, const std::string& what) {
  if (status.ok()) return;
  throw std::runtime_error(what + ": " + std::to_string(status.error_code()) + " " +
                           status.error_message());
}

template <typename Detail>
bool FindDetail(const grpc::Status& status, Detail* detail) {
  google::rpc::Status details;
  if (!details.ParseFromString(status.error_details())) return false;
  for (const auto& any : details.details()) {
    if (any.UnpackTo(detail)) return true;
  }
  return false;
}

bool IsDone(const v1::Job& job) { return job.state() >= v1::Job::STATE_SUCCEEDED; }

}  // namespace

TestClient::TestClient(const std::string& address)
    : TestClient(grpc::CreateChannel(address, grpc::InsecureChannelCredentials())) {}

TestClient::TestClient(std::shared_ptr<grpc::Channel> open_channel)
    : channel(std::move(open_channel)),
      scenes(v1::SceneService::NewStub(channel)),
      blobs(v1::BlobService::NewStub(channel)),
      bytes(google::bytestream::ByteStream::NewStub(channel)),
      jobs(v1::JobService::NewStub(channel)),
      colorizers(v1::ColorizerService::NewStub(channel)),
      server(v1::ServerService::NewStub(channel)),
      admin(v1::AdminService::NewStub(channel)) {}

v1::Digest DigestOf(const std::string& content) {
  v1::Digest digest;
  digest.set_sha256(Sha256Hex(content));
  digest.set_size_bytes(static_cast<int64_t>(content.size()));
  return digest;
}

std::string TinyPng() {
  static const unsigned char kBytes[] = {
      0x89, 0x50, 0x4E, 0x47, 0x0D, 0x0A, 0x1A, 0x0A, 0x00, 0x00, 0x00, 0x0D, 0x49, 0x48,
      0x44, 0x52, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x08, 0x00, 0x00, 0x00,
      0x00, 0x3A, 0x7E, 0x9B, 0x55, 0x00, 0x00, 0x00, 0x0A, 0x49, 0x44, 0x41, 0x54, 0x78,
      0x9C, 0x63, 0x60, 0x00, 0x00, 0x00, 0x02, 0x00, 0x01, 0x48, 0xAF, 0xA4, 0x71, 0x00,
      0x00, 0x00, 0x00, 0x49, 0x45, 0x4E, 0x44, 0xAE, 0x42, 0x60, 0x82};
  return {reinterpret_cast<const char*>(kBytes), sizeof(kBytes)};
}

v1::Digest TestClient::Upload(const std::string& content) {
  const v1::Digest digest = DigestOf(content);
  grpc::ClientContext context;
  google::bytestream::WriteResponse response;
  auto stream = bytes->Write(&context, &response);
  google::bytestream::WriteRequest request;
  request.set_resource_name("uploads/u1/blobs/" + digest.sha256() + "/" +
                            std::to_string(digest.size_bytes()));
  request.set_data(content);
  request.set_finish_write(true);
  stream->Write(request);
  stream->WritesDone();
  Require(stream->Finish(), "upload");
  return digest;
}

std::string TestClient::Download(const v1::Digest& digest) {
  grpc::ClientContext context;
  google::bytestream::ReadRequest request;
  request.set_resource_name("blobs/" + digest.sha256() + "/" + std::to_string(digest.size_bytes()));
  auto stream = bytes->Read(&context, request);
  google::bytestream::ReadResponse response;
  std::string content;
  while (stream->Read(&response)) content += response.data();
  Require(stream->Finish(), "download");
  return content;
}

v1::Scene TestClient::MakeScene() {
  v1::CreateSceneRequest create;
  for (const char* path : {"images/a.png", "images/b.png"}) {
    v1::SceneFile* file = create.add_files();
    file->set_path(path);
    *file->mutable_digest() = Upload(TinyPng());
  }
  v1::Scene scene;
  grpc::ClientContext create_context;
  Require(scenes->CreateScene(&create_context, create, &scene), "CreateScene");
  v1::CommitSceneRequest commit;
  commit.set_name(scene.name());
  grpc::ClientContext commit_context;
  Require(scenes->CommitScene(&commit_context, commit, &scene), "CommitScene");
  return scene;
}

v1::Job TestClient::Create(const v1::JobSpec& spec, const std::string& request_id) {
  v1::CreateJobRequest request;
  *request.mutable_spec() = spec;
  request.set_request_id(request_id);
  grpc::ClientContext context;
  v1::Job job;
  Require(jobs->CreateJob(&context, request, &job), "CreateJob");
  return job;
}

v1::Job TestClient::Get(const std::string& name) {
  v1::GetJobRequest request;
  request.set_name(name);
  grpc::ClientContext context;
  v1::Job job;
  Require(jobs->GetJob(&context, request, &job), "GetJob");
  return job;
}

std::vector<v1::Job> TestClient::Children(const std::string& name) {
  v1::ListJobsRequest request;
  request.set_parent(name);
  request.set_page_size(1000);
  grpc::ClientContext context;
  v1::ListJobsResponse response;
  Require(jobs->ListJobs(&context, request, &response), "ListJobs");
  return {response.jobs().begin(), response.jobs().end()};
}

v1::Job TestClient::WaitFinished(const std::string& name, int timeout_seconds) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(timeout_seconds);
  while (std::chrono::steady_clock::now() < deadline) {
    const v1::Job job = Get(name);
    bool done = IsDone(job);
    for (const v1::Job& child : Children(name)) done = done && IsDone(child);
    if (done) return job;
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
  }
  throw std::runtime_error(name + " is not finished after " + std::to_string(timeout_seconds) +
                           " s");
}

std::string ReasonOfStatus(const grpc::Status& status) {
  google::rpc::ErrorInfo info;
  return FindDetail(status, &info) ? info.reason() : "";
}

google::rpc::BadRequest BadRequestOf(const grpc::Status& status) {
  google::rpc::BadRequest bad;
  FindDetail(status, &bad);
  return bad;
}

bool HasRetryInfo(const grpc::Status& status) {
  google::rpc::RetryInfo retry;
  return FindDetail(status, &retry);
}

v1::JobSpec ScriptedSpec(const std::string& scene, const std::string& script, int seed) {
  v1::JobSpec spec;
  spec.set_scene(scene);
  spec.set_seed(static_cast<uint64_t>(seed));
  spec.mutable_select_key_view()->set_strategy(v1::SelectKeyViewSpec::STRATEGY_MANUAL);
  spec.mutable_select_key_view()->set_view(script);
  return spec;
}

}  // namespace color3d::testing
