#include <fstream>

#include "client/lib/blob_transfer.h"
#include "client/lib/names.h"
#include "client/lib/out_folder.h"
#include "core/base/files.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

namespace bs = google::bytestream;

// Streams that stall are cut by their time limit, so ranges are small.
constexpr int64_t kRangeBytes = int64_t{16} << 20;
constexpr std::chrono::seconds kRangeTimeLimit{300};

class Download {
 public:
  Download(Connection& connection, const FileDigest& digest, fs::path part)
      : connection_(connection), digest_(digest), part_(std::move(part)) {}

  // Writes the verified blob to the part file.
  void Run(const std::function<void(int64_t)>& progress) {
    RemoveUnlessPlainFile(part_);
    std::error_code none;
    received_ = fs::exists(part_, none) ? static_cast<int64_t>(fs::file_size(part_, none)) : 0;
    if (received_ > digest_.size_bytes) fs::remove(part_, none), received_ = 0;
    Backoff backoff = connection_.NewBackoff();
    FullServerWait turned_away(connection_);
    while (received_ < digest_.size_bytes) {
      connection_.cancel().ThrowIfCancelled();
      const int64_t before = received_;
      const grpc::Status status = Receive(kRangeBytes, kRangeTimeLimit, progress);
      if (received_ > before) backoff.Reset(), turned_away.Reset();
      if (status.ok() && received_ > before) continue;
      if (!status.ok() && turned_away.Wait(RpcError(status))) continue;
      if (!status.ok() && !RpcError(status).IsTransient() &&
          status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED) {
        throw RpcError(status);
      }
      if (!backoff.Wait(connection_.cancel())) throw ConnectionLostError(connection_.address());
    }
    if (digest_.size_bytes == 0) std::ofstream(part_, std::ios::binary);
    if (DigestFile(part_).sha256 == digest_.sha256) return;
    if (digest_.size_bytes > 0) ReceiveAll(progress);
    if (fs::exists(part_, none) && DigestFile(part_).sha256 == digest_.sha256) return;
    fs::remove(part_, none);
    throw Error(ErrorCode::kDataLoss,
                "the bytes received for blob {} do not have this digest; run the command again",
                digest_.sha256);
  }

 private:
  // The server notices that a blob is damaged only if it sends all of it in one stream; it then
  // moves it aside, so that the next upload or run replaces it. Throws the error of the server.
  void ReceiveAll(const std::function<void(int64_t)>& progress) {
    std::error_code none;
    fs::remove(part_, none);
    received_ = 0;
    const auto limit = kRangeTimeLimit * (1 + digest_.size_bytes / kRangeBytes);
    const grpc::Status status = Receive(/*most_bytes=*/0, limit, progress);
    if (!status.ok()) fs::remove(part_, none);
    ThrowIfFailed(status);
  }

  // Continues after the last range; `most_bytes` 0: to the end.
  grpc::Status Receive(int64_t most_bytes,
                       std::chrono::seconds time_limit,
                       const std::function<void(int64_t)>& progress) {
    std::ofstream output(part_, std::ios::binary | std::ios::app);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + time_limit);
    bs::ReadRequest request;
    request.set_resource_name(BlobResource(digest_));
    request.set_read_offset(received_);
    request.set_read_limit(std::min(most_bytes, digest_.size_bytes - received_));
    const auto stream = connection_.bytes().Read(&context, request);
    bs::ReadResponse response;
    while (stream->Read(&response)) {
      output.write(response.data().data(), static_cast<std::streamsize>(response.data().size()));
      if (!output.flush()) {
        context.TryCancel();
        stream->Finish();
        throw Error(ErrorCode::kResourceExhausted,
                    "cannot write {}; free some disk space and run the command again",
                    part_.string());
      }
      received_ += static_cast<int64_t>(response.data().size());
      progress(received_);
      if (connection_.cancel().IsCancelled()) context.TryCancel();
    }
    const grpc::Status status = stream->Finish();
    connection_.cancel().ThrowIfCancelled();
    return status;
  }

  Connection& connection_;
  const FileDigest digest_;
  const fs::path part_;
  int64_t received_ = 0;
};

bool HasSameContent(const fs::path& path, const FileDigest& digest) {
  std::error_code none;
  if (!fs::is_regular_file(fs::symlink_status(path, none))) return false;
  if (static_cast<int64_t>(fs::file_size(path, none)) != digest.size_bytes) return false;
  return DigestFile(path).sha256 == digest.sha256;
}

}  // namespace

void DownloadBlob(Connection& connection,
                  const FileDigest& digest,
                  const fs::path& path,
                  const std::function<void(int64_t)>& progress) {
  if (!IsSha256Hex(digest.sha256) || digest.size_bytes < 0) {
    throw Error(ErrorCode::kDataLoss,
                "the server sent a malformed digest of {}: '{}', {} bytes; nothing was written",
                path.filename().string(),
                digest.sha256,
                digest.size_bytes);
  }
  if (HasSameContent(path, digest)) return progress(digest.size_bytes);
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  if (error) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot create the folder {}: {}",
                path.parent_path().string(),
                error.message());
  }
  const fs::path part = path.parent_path() / (".color3d-" + digest.sha256.substr(0, 16) + ".part");
  Download(connection, digest, part).Run(progress);
  PublishFile(part, path);
}

}  // namespace color3d::client
