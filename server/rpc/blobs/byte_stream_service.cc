// google.bytestream.ByteStream for the blobs of the caller's project.
#include <memory>

#include "google/bytestream/bytestream.grpc.pb.h"
#include "server/rpc/blobs/blob_service.h"
#include "server/rpc/blobs/blob_streams.h"

namespace color3d {
namespace {
using google::bytestream::ReadRequest;
using google::bytestream::ReadResponse;
using google::bytestream::WriteRequest;
using google::bytestream::WriteResponse;
using grpc::CallbackServerContext;
using grpc::ServerUnaryReactor;

// Another project may have stored the same bytes; projects that have not sent them must do so.
BlobRights RightsOf(const RpcParts& parts, const Call& call) {
  return {
      call.caller.project,
      [&parts, store = call.store](const FileDigest& blob) { return HasBlob(parts, store, blob); },
      [&parts, store = call.store](int64_t bytes) { RequireQuota(parts, store, bytes); },
      [store = call.store](const FileDigest& blob) { store.HoldBlob(blob); }};
}

class ByteStreamServiceImpl final : public google::bytestream::ByteStream::CallbackService {
 public:
  explicit ByteStreamServiceImpl(const RpcParts& parts) : parts_(parts) {}

  grpc::ServerWriteReactor<ReadResponse>* Read(CallbackServerContext* context,
                                               const ReadRequest* request) override {
    return ReadBlob(parts_, *context, *request, Admission(Role::kRead));
  }

  grpc::ServerReadReactor<WriteRequest>* Write(CallbackServerContext* context,
                                               WriteResponse* response) override {
    return WriteBlob(parts_, *context, response, Admission(Role::kSubmit));
  }

  ServerUnaryReactor* QueryWriteStatus(
      CallbackServerContext* context,
      const google::bytestream::QueryWriteStatusRequest* request,
      google::bytestream::QueryWriteStatusResponse* response) override {
    return AnswerWrite(parts_, context, request, response, [=, this](const Call& call) {
      QueryBlobWrite(parts_, RightsOf(parts_, call), *request, response);
    });
  }

 private:
  BlobAdmission Admission(Role role) const {
    return [this, role](const CallbackServerContext& context) {
      return RightsOf(parts_, Admit(parts_, role, context));
    };
  }

  const RpcParts& parts_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeByteStreamService(const RpcParts& parts) {
  return std::make_unique<ByteStreamServiceImpl>(parts);
}

}  // namespace color3d
