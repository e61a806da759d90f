#include <fstream>
#include <map>
#include <set>

#include "client/lib/blob_transfer.h"
#include "client/lib/names.h"

namespace color3d::client {
namespace {

namespace bs = google::bytestream;

constexpr int64_t kChunkBytes = 512 << 10;
constexpr int kMaxDigestsPerRequest = 10'000;
constexpr int64_t kSlowestBytesPerSecond = 32 << 10;

std::chrono::seconds TimeLimit(int64_t bytes) {
  return std::chrono::seconds(60 + bytes / kSlowestBytesPerSecond);
}

std::vector<UploadFile> Missing(Connection& connection, const std::vector<UploadFile>& files) {
  std::map<std::string, const UploadFile*> by_sha;
  for (const UploadFile& file : files) by_sha.emplace(file.digest.sha256, &file);
  std::vector<UploadFile> missing;
  v1::FindMissingBlobsRequest request;
  const auto ask = [&] {
    const auto response =
        connection.Call(&v1::BlobService::Stub::FindMissingBlobs, connection.blobs(), request);
    for (const v1::Digest& digest : response.missing()) {
      const auto found = by_sha.find(digest.sha256());
      if (found != by_sha.end()) missing.push_back(*found->second);
    }
    request.Clear();
  };
  for (const auto& [sha, file] : by_sha) {
    v1::Digest* digest = request.add_digests();
    digest->set_sha256(sha);
    digest->set_size_bytes(file->digest.size_bytes);
    if (request.digests_size() == kMaxDigestsPerRequest) ask();
  }
  if (request.digests_size() > 0) ask();
  return missing;
}

// Upload of one file, across broken connections.
class Upload {
 public:
  Upload(Connection& connection, const UploadFile& file)
      : connection_(connection), file_(file), resource_(UploadResource(NewUuid(), file.digest)) {}

  void Run(const std::function<void(int64_t committed_bytes)>& progress) {
    Backoff backoff = connection_.NewBackoff();
    FullServerWait turned_away(connection_);
    int64_t best = 0;
    while (!complete_) {
      connection_.cancel().ThrowIfCancelled();
      const grpc::Status status = Send(progress);
      if (complete_) return;
      if (committed_ > best) backoff.Reset(), turned_away.Reset();
      best = std::max(best, committed_);
      if (status.ok() || !turned_away.Wait(RpcError(status))) {
        if (!status.ok()) ThrowIfFinal(status);
        if (!backoff.Wait(connection_.cancel())) ThrowFinalError(status);
      }
      QueryCommittedSize();
    }
  }

 private:
  // Sends from the committed size to the end on one stream.
  grpc::Status Send(const std::function<void(int64_t)>& progress) {
    std::ifstream input(file_.file, std::ios::binary);
    input.seekg(committed_);
    if (!input) throw Changed();
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + TimeLimit(file_.digest.size_bytes));
    bs::WriteResponse response;
    const auto stream = connection_.bytes().Write(&context, &response);
    int64_t offset = committed_;
    bool finished = false;
    while (!finished) {
      if (connection_.cancel().IsCancelled()) context.TryCancel();
      bs::WriteRequest request;
      if (offset == committed_) request.set_resource_name(resource_);
      request.set_write_offset(offset);
      const int64_t size = std::min(kChunkBytes, file_.digest.size_bytes - offset);
      request.mutable_data()->resize(static_cast<size_t>(size));
      input.read(request.mutable_data()->data(), size);
      if (input.gcount() != size) {
        context.TryCancel();
        stream->Finish();
        throw Changed();
      }
      offset += size;
      finished = offset == file_.digest.size_bytes;
      request.set_finish_write(finished);
      if (!stream->Write(request)) break;
      progress(offset);
    }
    stream->WritesDone();
    const grpc::Status status = stream->Finish();
    connection_.cancel().ThrowIfCancelled();
    complete_ = status.ok() && response.committed_size() == file_.digest.size_bytes;
    return status;
  }

  void QueryCommittedSize() {
    bs::QueryWriteStatusRequest request;
    request.set_resource_name(resource_);
    const auto response =
        connection_.Call(&bs::ByteStream::Stub::QueryWriteStatus, connection_.bytes(), request);
    complete_ = response.complete();
    committed_ = response.committed_size();
  }

  void ThrowIfFinal(const grpc::Status& status) const {
    const RpcError error(status);
    if (error.HasReason(ErrorReason::kDigestMismatch)) throw Changed();
    const bool again = error.IsTransient() || error.HasReason(ErrorReason::kOffsetMismatch) ||
                       error.grpc_code() == grpc::StatusCode::ABORTED ||
                       error.grpc_code() == grpc::StatusCode::DEADLINE_EXCEEDED;
    if (!again) throw error;
  }

  [[noreturn]] void ThrowFinalError(const grpc::Status& status) const {
    if (status.ok() || RpcError(status).IsUnreachable()) {
      throw ConnectionLostError(connection_.address());
    }
    throw RpcError(status);
  }

  Error Changed() const {
    return InvalidArgument("{} changed while it was read; run the command again",
                           file_.file.string());
  }

  Connection& connection_;
  const UploadFile& file_;
  const std::string resource_;
  int64_t committed_ = 0;
  bool complete_ = false;
};

}  // namespace

void UploadMissing(Connection& connection,
                   const std::vector<UploadFile>& files,
                   const TransferProgress& progress) {
  const std::vector<UploadFile> missing = Missing(connection, files);
  int64_t total = 0;
  for (const UploadFile& file : missing) total += file.digest.size_bytes;
  int64_t before = 0;
  for (const UploadFile& file : missing) {
    Upload(connection, file).Run([&](int64_t committed) { progress(before + committed, total); });
    before += file.digest.size_bytes;
  }
  progress(total, total);
}

}  // namespace color3d::client
