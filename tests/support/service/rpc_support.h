// A client of all services for tests, with common steps.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <vector>

#include "color3d/v1/admin.grpc.pb.h"
#include "color3d/v1/blob.grpc.pb.h"
#include "color3d/v1/colorizer.grpc.pb.h"
#include "color3d/v1/job.grpc.pb.h"
#include "color3d/v1/scene.grpc.pb.h"
#include "color3d/v1/server.grpc.pb.h"
#include "google/bytestream/bytestream.grpc.pb.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace color3d::testing {

struct TestClient {
  explicit TestClient(const std::string& address);
  explicit TestClient(std::shared_ptr<grpc::Channel> open_channel);
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::SceneService::Stub> scenes;
  std::unique_ptr<v1::BlobService::Stub> blobs;
  std::unique_ptr<google::bytestream::ByteStream::Stub> bytes;
  std::unique_ptr<v1::JobService::Stub> jobs;
  std::unique_ptr<v1::ColorizerService::Stub> colorizers;
  std::unique_ptr<v1::ServerService::Stub> server;
  std::unique_ptr<v1::AdminService::Stub> admin;

  // All functions throw std::runtime_error with the status if an RPC fails.
  v1::Digest Upload(const std::string& content);
  std::string Download(const v1::Digest& digest);
  // An active scene with two photographs.
  v1::Scene MakeScene();
  v1::Job Create(const v1::JobSpec& spec, const std::string& request_id = "");
  v1::Job Get(const std::string& name);
  std::vector<v1::Job> Children(const std::string& name);
  // Polls until the job and its children are finished.
  v1::Job WaitFinished(const std::string& name, int timeout_seconds = 60);
};

v1::Digest DigestOf(const std::string& content);
// A grey PNG of 1 x 1 pixels.
std::string TinyPng();
// ErrorInfo.reason of a status; empty if there is none.
std::string ReasonOfStatus(const grpc::Status& status);
google::rpc::BadRequest BadRequestOf(const grpc::Status& status);
bool HasRetryInfo(const grpc::Status& status);

// A select_key_view job with a script for the test worker.
v1::JobSpec ScriptedSpec(const std::string& scene, const std::string& script, int seed = 1);

}  // namespace color3d::testing
