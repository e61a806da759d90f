// Server that breaks connections on purpose, with the fixture of tests of the client library.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <map>
#include <thread>

#include "client/lib/blob_transfer.h"
#include "client/lib/job_watch.h"
#include "core/base/files.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace color3d::client {

namespace bs = google::bytestream;

inline std::string Digits(const std::string& resource) {
  return resource.substr(resource.find("blobs/"));
}

// Status that asks to retry in a second.
inline grpc::Status TurnedAway() {
  google::rpc::Status details;
  details.set_code(grpc::StatusCode::RESOURCE_EXHAUSTED);
  google::rpc::ErrorInfo info;
  info.set_reason("TOO_MANY_STREAMS");
  details.add_details()->PackFrom(info);
  google::rpc::RetryInfo retry;
  retry.mutable_retry_delay()->set_seconds(1);
  details.add_details()->PackFrom(retry);
  return {grpc::StatusCode::RESOURCE_EXHAUSTED, "too many streams", details.SerializeAsString()};
}

// Holds blobs by "blobs/{sha}/{size}"; drops every stream but the last after `limit` bytes.
class BreakingBlobs final : public bs::ByteStream::Service, public v1::BlobService::Service {
 public:
  std::map<std::string, std::string> blobs;
  std::map<std::string, std::string> uploads;
  int drops = 0;  // number of streams still to be dropped
  size_t limit = 0;
  int writes = 0;
  bool corrupt = false;  // changes the first byte of blobs
  int turned_away = 0;   // number of streams still to be refused for now

  grpc::Status FindMissingBlobs(grpc::ServerContext*,
                                const v1::FindMissingBlobsRequest* request,
                                v1::FindMissingBlobsResponse* response) override {
    for (const v1::Digest& digest : request->digests()) {
      const std::string name =
          "blobs/" + digest.sha256() + "/" + std::to_string(digest.size_bytes());
      if (!blobs.contains(name)) *response->add_missing() = digest;
    }
    return grpc::Status::OK;
  }
  grpc::Status Write(grpc::ServerContext*,
                     grpc::ServerReader<bs::WriteRequest>* reader,
                     bs::WriteResponse* response) override {
    ++writes;
    if (turned_away-- > 0) return TurnedAway();
    bs::WriteRequest request;
    std::string name;
    size_t taken = 0;
    while (reader->Read(&request)) {
      if (!request.resource_name().empty()) name = request.resource_name();
      std::string& upload = uploads[name];
      if (request.write_offset() != static_cast<int64_t>(upload.size())) {
        return {grpc::StatusCode::INVALID_ARGUMENT, "wrong offset"};
      }
      upload += request.data();
      taken += request.data().size();
      if (drops > 0 && taken >= limit) {
        --drops;
        return {grpc::StatusCode::UNAVAILABLE, "dropped on purpose"};
      }
      if (request.finish_write()) {
        blobs[Digits(name)] = upload;
        response->set_committed_size(static_cast<int64_t>(upload.size()));
        return grpc::Status::OK;
      }
    }
    return {grpc::StatusCode::INVALID_ARGUMENT, "no end"};
  }
  grpc::Status QueryWriteStatus(grpc::ServerContext*,
                                const bs::QueryWriteStatusRequest* request,
                                bs::QueryWriteStatusResponse* response) override {
    response->set_committed_size(static_cast<int64_t>(uploads[request->resource_name()].size()));
    return grpc::Status::OK;
  }
  grpc::Status Read(grpc::ServerContext*,
                    const bs::ReadRequest* request,
                    grpc::ServerWriter<bs::ReadResponse>* writer) override {
    if (turned_away-- > 0) return TurnedAway();
    const auto found = blobs.find(request->resource_name());
    if (found == blobs.end()) return {grpc::StatusCode::NOT_FOUND, "unknown blob"};
    std::string bytes = found->second.substr(static_cast<size_t>(request->read_offset()));
    if (request->read_limit() > 0)
      bytes.resize(std::min<size_t>(bytes.size(), request->read_limit()));
    if (corrupt && !bytes.empty()) bytes[0] ^= 1;
    const bool drop = drops > 0;
    if (drop) --drops, bytes.resize(std::min(bytes.size(), limit));
    for (size_t at = 0; at < bytes.size(); at += 1000) {
      bs::ReadResponse response;
      response.set_data(bytes.substr(at, 1000));
      writer->Write(response);
    }
    if (corrupt && request->read_limit() == 0) {
      blobs.erase(found);
      return {grpc::StatusCode::DATA_LOSS, "damaged and set aside"};
    }
    return drop ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "dropped on purpose")
                : grpc::Status::OK;
  }
};

// Scripted streams, in order: revisions to send, then a status.
class BreakingJobs final : public v1::JobService::Service {
 public:
  struct Stream {
    std::vector<int64_t> revisions;
    grpc::Status end;
    int hold_ms = 0;
  };
  std::vector<Stream> script;
  std::vector<int64_t> asked;  // after_revision of each stream

  grpc::Status WatchJobs(grpc::ServerContext* context,
                         const v1::WatchJobsRequest* request,
                         grpc::ServerWriter<v1::JobEvent>* writer) override {
    asked.push_back(request->after_revision());
    if (asked.size() > script.size()) return grpc::Status::OK;
    const Stream& stream = script[asked.size() - 1];
    for (const int64_t revision : stream.revisions) {
      v1::JobEvent event;
      event.set_revision(revision);
      event.set_kind(v1::JobEvent::KIND_STATE);
      event.mutable_job()->set_name("jobs/1");
      writer->Write(event);
    }
    for (int waited = 0; waited < stream.hold_ms && !context->IsCancelled(); waited += 20) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return stream.end;
  }
};

class BreakingServerTest : public ::testing::Test {
 protected:
  BreakingServerTest() {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(static_cast<bs::ByteStream::Service*>(&blobs_));
    builder.RegisterService(static_cast<v1::BlobService::Service*>(&blobs_));
    builder.RegisterService(&jobs_);
    server_ = builder.BuildAndStart();
    connection_ = std::make_unique<Connection>(
        ServerTarget{.address = "127.0.0.1:" + std::to_string(port)}, cancel_);
    for (int i = 0; i < 3'000'000; ++i) bytes_ += static_cast<char>(i * 2654435761u >> 13);
    digest_ = {Sha256Hex(bytes_), static_cast<int64_t>(bytes_.size())};
    name_ = "blobs/" + digest_.sha256 + "/" + std::to_string(digest_.size_bytes);
  }
  void Upload(const std::string& bytes) {
    WriteFileAtomic(file_, bytes);
    UploadMissing(*connection_, {{file_, digest_}}, [this](int64_t done, int64_t total) {
      EXPECT_LE(done, total);
      last_done_ = done;
    });
  }
  void Download() {
    DownloadBlob(*connection_, digest_, target_, [](int64_t) {});
  }

  CancellationToken cancel_;
  BreakingBlobs blobs_;
  BreakingJobs jobs_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<Connection> connection_;
  ScratchFolder scratch_;
  std::filesystem::path file_ = scratch_.path() / "file";
  std::filesystem::path target_ = scratch_.path() / "out/deep/result.bin";
  std::string bytes_;
  FileDigest digest_;
  std::string name_;
  int64_t last_done_ = -1;
};

}  // namespace color3d::client
