#include "server/rpc/blobs/blob_streams.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <memory>
#include <utility>

#include "server/base/service_error.h"
#include "server/rpc/blobs/blob_service.h"

namespace color3d {
namespace {
using google::bytestream::ReadRequest;
using google::bytestream::ReadResponse;
using google::bytestream::WriteRequest;
using google::bytestream::WriteResponse;
using grpc::CallbackServerContext;

constexpr int64_t kReadChunkBytes = 256 << 10;
constexpr size_t kNameBytes = 1024;  // size of a message besides its data

class BlobReader final : public grpc::ServerWriteReactor<ReadResponse> {
 public:
  BlobReader(const RpcParts& parts,
             CallbackServerContext& context,
             const ReadRequest& request,
             BlobAdmission admission)
      : parts_(parts),
        context_(context),
        request_(request),
        admission_(std::move(admission)),
        silence_(parts.silence, [this] { GiveUp(); }) {
    parts_.bulk.Post([this] { Step(); });
  }
  ~BlobReader() override {
    if (fd_ >= 0) ::close(fd_);
  }
  void OnWriteDone(bool ok) override {
    if (!silence_.Resume()) return FinishGivenUp();
    if (!ok) return Finish(grpc::Status::CANCELLED);
    parts_.bulk.Post([this] { Step(); });
  }
  // Called after Finish and after the last Step.
  void OnDone() override { delete this; }

 private:
  // The first call opens the blob; later calls read and send one chunk, or finish.
  void Step() {
    bool more = false;
    const grpc::Status status = Guard([&] {
      if (fd_ < 0) Open();
      more = NextChunk();
      if (!more) RequireIntact();
    });
    if (!status.ok() || !more) return Finish(status);
    silence_.Wait();
    StartWrite(&response_);
  }

  // The client does not read. Cancels the call, so that the pending write ends, too.
  void GiveUp() {
    context_.TryCancel();
    FinishGivenUp();
  }
  // Called by the end of the write or by the silence watch, whichever comes last; this object lives
  // until then.
  void FinishGivenUp() {
    if (given_up_.exchange(true)) Finish(grpc::Status::CANCELLED);
  }

  void Open() {
    const BlobRights rights = admission_(context_);
    place_ = parts_.streams.reads.Take(rights.owner);
    const FileDigest digest = ParseBlobName(request_.resource_name());
    if (!rights.has(digest)) {
      throw ServiceError(ErrorReason::kBlobMissing, "'{}' is not stored", request_.resource_name());
    }
    if (request_.read_offset() < 0 || request_.read_limit() < 0) {
      throw InvalidArgument("read_offset and read_limit must not be negative");
    }
    if (request_.read_offset() > digest.size_bytes) {
      throw ServiceError(ErrorReason::kOffsetBeyondEnd,
                         "read_offset is {}, the blob has {} bytes",
                         request_.read_offset(),
                         digest.size_bytes);
    }
    offset_ = request_.read_offset();
    is_whole_ = offset_ == 0;
    sha256_ = digest.sha256;
    end_ = digest.size_bytes;
    if (request_.read_limit() > 0) {
      is_whole_ &= request_.read_limit() >= end_;
      end_ = std::min(end_, offset_ + request_.read_limit());
    }
    parts_.blobs.Borrow(digest.sha256, [this](const std::filesystem::path& file) {
      fd_ = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
    });
    if (fd_ < 0) throw Error(ErrorCode::kInternal, "cannot open a stored blob");
  }

  bool NextChunk() {
    if (offset_ >= end_) return false;
    std::string* data = response_.mutable_data();
    data->resize(static_cast<size_t>(std::min(kReadChunkBytes, end_ - offset_)));
    const ssize_t got = ::pread(fd_, data->data(), data->size(), offset_);
    if (got <= 0) {
      throw Error(ErrorCode::kDataLoss, "'{}' is shorter on disk", request_.resource_name());
    }
    data->resize(static_cast<size_t>(got));
    offset_ += got;
    if (is_whole_) sent_.Update(*data);
    return true;
  }

  // A download of a whole blob verifies its digest.
  void RequireIntact() {
    if (!is_whole_ || sent_.FinishHex() == sha256_) return;
    if (parts_.blobs.SetAside(sha256_)) {
      throw ServiceError(
          ErrorReason::kBlobDamaged,
          "'{}' was damaged on the server's disk and is set aside; upload it again, or "
          "run the job again with skip_cache",
          request_.resource_name());
    }
    throw ServiceError(
        ErrorReason::kBlobMended,
        "'{}' was damaged on the server's disk while it was sent, and is repaired now; "
        "download it again",
        request_.resource_name());
  }

  const RpcParts& parts_;
  CallbackServerContext& context_;
  const ReadRequest request_;
  const BlobAdmission admission_;
  ReadResponse response_;
  int fd_ = -1;
  int64_t offset_ = 0;
  int64_t end_ = 0;
  bool is_whole_ = false;
  std::string sha256_;
  Sha256 sent_;
  StreamLimit::Place place_;
  std::atomic<bool> given_up_{false};
  SilenceWatch::Stream silence_;
};

class BlobWriter final : public grpc::ServerReadReactor<WriteRequest> {
 public:
  BlobWriter(const RpcParts& parts,
             const CallbackServerContext& context,
             WriteResponse* response,
             const BlobAdmission& admission)
      : parts_(parts),
        response_(response),
        silence_(parts.silence, [this] { parts_.bulk.Post([this] { GiveUp(); }); }) {
    // Nothing is read from callers without the role or above their limit of streams.
    const grpc::Status allowed = Guard([&] {
      rights_ = admission(context);
      place_ = parts_.streams.writes.Take(rights_.owner);
    });
    allowed.ok() ? ReadNext() : Finish(allowed);
  }
  void OnReadDone(bool ok) override {
    if (!silence_.Resume()) return;  // given up
    // Checked before the message waits for the executor.
    const grpc::Status fits = Guard([&] {
      if (ok) RequireSmallChunk();
    });
    if (fits.ok()) return parts_.bulk.Post([this, ok] { ok ? Consume() : EndOfStream(); });
    WriteRequest().Swap(&request_);
    parts_.bulk.Post([this, fits] { End(fits); });
  }
  void OnDone() override { delete this; }

 private:
  void Consume() {
    bool finished = false;
    const grpc::Status status = Guard([&] { finished = Store(); });
    if (status.ok() && !finished) return ReadNext();
    End(status);
  }

  void ReadNext() {
    silence_.Wait();
    StartRead(&request_);
  }

  // Releases the place of the stream. The pending read ends with the call.
  void GiveUp() {
    End(Guard([&] {
      if (writer_) writer_->Sync();
      throw ServiceError(
          ErrorReason::kUploadSilent,
          "the upload was silent for {} s; the received bytes are kept: call QueryWriteStatus and "
          "continue from there",
          parts_.silence.limit().count() / 1000);
    }));
  }

  void End(const grpc::Status& status) {
    writer_.reset();
    Finish(status);
  }

  void RequireSmallChunk() const {
    if (request_.ByteSizeLong() <=
        static_cast<size_t>(parts_.limits.max_chunk_bytes) + kNameBytes) {
      return;
    }
    throw InvalidArgument("the chunk has {} bytes; at most {} are allowed",
                          request_.data().size(),
                          parts_.limits.max_chunk_bytes);
  }

  // Returns whether the RPC has been answered.
  bool Store() {
    if (!writer_) {
      name_ = ParseUploadName(request_.resource_name());
      name_.owner = rights_.owner;
      // Another project may have stored the same bytes; projects that have not sent them must do
      // so.
      if (rights_.has(name_.digest)) {
        response_->set_committed_size(name_.digest.size_bytes);
        return true;
      }
      writer_ = parts_.uploads.Open(name_, request_.write_offset(), rights_.admit);
      resource_ = request_.resource_name();
    } else if (!request_.resource_name().empty() && request_.resource_name() != resource_) {
      throw InvalidArgument("resource_name changes within the stream");
    }
    writer_->Append(request_.write_offset(), request_.data());
    if (!request_.finish_write()) return false;
    response_->set_committed_size(writer_->Sync());
    writer_->Finish();
    rights_.on_stored(name_.digest);
    return true;
  }

  // The client stopped without finish_write, or the connection broke: keeps the received bytes.
  void EndOfStream() {
    const grpc::Status status = Guard([&] {
      if (!writer_) throw InvalidArgument("the stream ended before its first message");
      response_->set_committed_size(writer_->Sync());
    });
    End(status);
  }

  const RpcParts& parts_;
  WriteResponse* response_;
  WriteRequest request_;
  std::string resource_;
  UploadName name_;
  BlobRights rights_;  // empty: refused
  std::unique_ptr<UploadStore::Writer> writer_;
  StreamLimit::Place place_;
  SilenceWatch::Stream silence_;
};

}  // namespace

grpc::ServerWriteReactor<ReadResponse>* ReadBlob(const RpcParts& parts,
                                                 CallbackServerContext& context,
                                                 const ReadRequest& request,
                                                 const BlobAdmission& admission) {
  return new BlobReader(parts, context, request, admission);
}

grpc::ServerReadReactor<WriteRequest>* WriteBlob(const RpcParts& parts,
                                                 const CallbackServerContext& context,
                                                 WriteResponse* response,
                                                 const BlobAdmission& admission) {
  return new BlobWriter(parts, context, response, admission);
}

void QueryBlobWrite(const RpcParts& parts,
                    const BlobRights& rights,
                    const google::bytestream::QueryWriteStatusRequest& request,
                    google::bytestream::QueryWriteStatusResponse* response) {
  UploadName name = ParseUploadName(request.resource_name());
  name.owner = rights.owner;
  const bool complete = rights.has(name.digest);
  response->set_complete(complete);
  response->set_committed_size(complete ? name.digest.size_bytes
                                        : parts.uploads.CommittedSize(name));
}

}  // namespace color3d
