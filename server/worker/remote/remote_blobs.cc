#include "server/worker/remote/remote_blobs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

#include "core/base/error.h"
#include "server/base/service_error.h"
#include "server/rpc/calls/error_mapping.h"
#include "server/store/job.h"

namespace color3d {
namespace fs = std::filesystem;
namespace bs = google::bytestream;
namespace wire = internal::v1;
using Stub = WorkerLink::Stub;
namespace {

constexpr int64_t kChunkBytes = 512 << 10;
constexpr int64_t kSlowestBytesPerSecond = 32 << 10;

// Time limit of a stream; a dead connection ends it earlier.
std::chrono::milliseconds StreamLimit(int64_t bytes) {
  return std::chrono::seconds(60 + bytes / kSlowestBytesPerSecond);
}

// A file for writing or reading; closed by the destructor.
class OpenFile {
 public:
  OpenFile(const fs::path& file, int flags) : file_(file) {
    fd_ = ::open(file.c_str(), flags | O_CLOEXEC, 0600);
    if (fd_ < 0) Throw("open");
  }
  ~OpenFile() { ::close(fd_); }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  void Append(std::string_view data) {
    while (!data.empty()) {
      const ssize_t put = ::write(fd_, data.data(), data.size());
      if (put < 0 && errno == EINTR) continue;
      if (put < 0) Throw("write");
      data.remove_prefix(static_cast<size_t>(put));
    }
  }
  std::string Read(int64_t offset, int64_t size) const {
    std::string data(static_cast<size_t>(size), '\0');
    int64_t done = 0;
    while (done < size) {
      const ssize_t got =
          ::pread(fd_, data.data() + done, static_cast<size_t>(size - done), offset + done);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) Throw("read");
      if (got == 0) {
        throw Error(ErrorCode::kDataLoss, "{} became shorter while it was sent", file_.string());
      }
      done += got;
    }
    return data;
  }

 private:
  [[noreturn]] void Throw(const char* what) const {
    if (errno == ENOSPC || errno == EDQUOT) {
      throw ServiceError(ErrorReason::kStorageFull,
                         "cannot {} {}: the worker's disk is full; free some space, or give a "
                         "smaller --cache-mib",
                         what,
                         file_.string());
    }
    throw Error(
        ErrorCode::kUnavailable, "cannot {} {}: {}", what, file_.string(), std::strerror(errno));
  }
  const fs::path file_;
  int fd_ = -1;
};

std::string BlobResource(const FileDigest& digest) {
  return fmt::format("blobs/{}/{}", digest.sha256, digest.size_bytes);
}

// The server has cut or lost a part of the upload: continue from what it has.
bool CanResume(const grpc::Status& status) {
  if (IsWorthRetry(status)) return true;
  try {
    ThrowIfFailed(status);
  } catch (const Error& e) {
    return HasReason(e, ErrorReason::kOffsetMismatch) ||
           HasReason(e, ErrorReason::kUploadTakenOver);
  }
  return false;
}

}  // namespace

bool RemoteBlobs::Touch(const FileDigest& digest) const {
  return link_.Retry(&Stub::TouchBlob, ToWire(digest)).stored();
}

std::optional<StoredBlob> RemoteBlobs::Look(const std::string& sha256) const {
  wire::LookBlobRequest request;
  request.set_sha256(sha256);
  const wire::LookBlobResponse response = link_.Retry(&Stub::LookBlob, request);
  if (!response.has_blob()) return std::nullopt;
  return FromWire(response.blob());
}

void RemoteBlobs::Borrow(const std::string& sha256,
                         const std::function<void(const fs::path&)>& use) const {
  cache_.Use(
      sha256, [&](const fs::path& part) { Download(sha256, part); }, use);
}

void RemoteBlobs::Download(const std::string& sha256, const fs::path& part) const {
  const std::optional<StoredBlob> blob = Look(sha256);
  if (!blob) {
    throw ServiceError(ErrorReason::kBlobMissing, "the blob {} is not stored; upload it", sha256);
  }
  const int64_t size = blob->digest.size_bytes;
  RetryPause pause(link_.timing().patience);
  for (bool again = false;; again = true) {
    std::error_code none;
    if (again) fs::remove(part, none);
    {
      OpenFile file(part, O_WRONLY | O_CREAT | O_APPEND);
      auto received = static_cast<int64_t>(fs::file_size(part));
      while (received < size) {
        grpc::ClientContext context;
        link_.Prepare(&context, StreamLimit(size));
        bs::ReadRequest request;
        request.set_resource_name(BlobResource(blob->digest));
        request.set_read_offset(received);
        const auto stream = link_.stub().ReadBlob(&context, request);
        const std::shared_ptr<void> cancel(nullptr, [&](void*) { context.TryCancel(); });
        bs::ReadResponse response;
        while (stream->Read(&response)) {
          file.Append(response.data());
          received += static_cast<int64_t>(response.data().size());
          pause.Reset();
        }
        const grpc::Status status = stream->Finish();
        if (!status.ok() && !IsWorthRetry(status)) link_.Require(status);
        if (received >= size) break;
        if (pause.Wait()) continue;
        link_.Require(status);
        throw Error(ErrorCode::kUnavailable, "the server sends nothing of the blob {}", sha256);
      }
    }
    if (DigestFile(part).sha256 == sha256) return;
    fs::remove(part, none);
    // The server verifies a blob that it sends as a whole, and sets a damaged one aside.
    if (!again) continue;
    throw Error(ErrorCode::kDataLoss,
                "the bytes received for the blob {} do not have this digest; check the connection "
                "and the disk of this worker",
                sha256);
  }
}

void RemoteBlobs::Upload(const FileDigest& digest, const Source& source) const {
  const std::string resource =
      fmt::format("uploads/{}-{}/blobs/{}/{}", NewId(), NewId(), digest.sha256, digest.size_bytes);
  RetryPause pause(link_.timing().patience);
  int64_t committed = 0;
  while (true) {
    grpc::ClientContext context;
    link_.Prepare(&context, StreamLimit(digest.size_bytes));
    bs::WriteResponse response;
    const auto stream = link_.stub().WriteBlob(&context, &response);
    const std::shared_ptr<void> cancel(nullptr, [&](void*) { context.TryCancel(); });
    bs::WriteRequest request;
    request.set_resource_name(resource);
    for (int64_t offset = committed;; request.clear_resource_name()) {
      const int64_t size = std::min(kChunkBytes, digest.size_bytes - offset);
      request.set_write_offset(offset);
      request.set_data(source(offset, size));
      offset += size;
      request.set_finish_write(offset == digest.size_bytes);
      if (!stream->Write(request) || request.finish_write()) break;
    }
    stream->WritesDone();
    const grpc::Status status = stream->Finish();
    if (status.ok() && response.committed_size() == digest.size_bytes) return;
    if (!status.ok() && (!CanResume(status) || !pause.Wait())) link_.Require(status);
    bs::QueryWriteStatusRequest query;
    query.set_resource_name(resource);
    const auto known = link_.Retry(&Stub::QueryBlobWrite, query);
    if (known.complete()) return;
    if (known.committed_size() > committed) pause.Reset();
    committed = known.committed_size();
  }
}

void RemoteBlobs::UploadFile(const fs::path& file, const FileDigest& digest) const {
  const OpenFile open(file, O_RDONLY);
  Upload(digest, [&](int64_t offset, int64_t size) { return open.Read(offset, size); });
}

FileDigest RemoteBlobs::PutBytes(std::string_view bytes) {
  const FileDigest digest{Sha256Hex(bytes), static_cast<int64_t>(bytes.size())};
  Upload(digest, [&](int64_t offset, int64_t size) {
    return std::string(bytes.substr(static_cast<size_t>(offset), static_cast<size_t>(size)));
  });
  return digest;
}

FileDigest RemoteBlobs::PutFile(const fs::path& file) {
  const FileDigest digest = DigestFile(file);
  UploadFile(file, digest);
  cache_.Put(file, digest);
  return digest;
}

void RemoteBlobs::Adopt(const fs::path& file, const FileDigest& digest) {
  UploadFile(file, digest);
  std::error_code none;
  fs::remove(file, none);
}

void RemoteBlobs::RequireSpace(int64_t) const {}

bool RemoteBlobs::RemoveIfUntouched(const StoredBlob& blob) {
  return link_.Once(&Stub::RemoveBlob, ToWire(blob)).removed();
}

}  // namespace color3d
