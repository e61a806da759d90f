// color3d.v1.BlobService and google.bytestream.ByteStream.
#pragma once

#include "color3d/v1/blob.grpc.pb.h"
#include "google/bytestream/bytestream.grpc.pb.h"
#include "server/rpc/calls/rpc_parts.h"

namespace color3d {

class BlobServiceImpl final : public v1::BlobService::CallbackService {
 public:
  explicit BlobServiceImpl(const RpcParts& parts) : parts_(parts) {}
  grpc::ServerUnaryReactor* FindMissingBlobs(grpc::CallbackServerContext* context,
                                             const v1::FindMissingBlobsRequest* request,
                                             v1::FindMissingBlobsResponse* response) override;

 private:
  const RpcParts& parts_;
};

class ByteStreamServiceImpl final : public google::bytestream::ByteStream::CallbackService {
 public:
  explicit ByteStreamServiceImpl(const RpcParts& parts) : parts_(parts) {}
  grpc::ServerWriteReactor<google::bytestream::ReadResponse>* Read(
      grpc::CallbackServerContext* context,
      const google::bytestream::ReadRequest* request) override;
  grpc::ServerReadReactor<google::bytestream::WriteRequest>* Write(
      grpc::CallbackServerContext* context, google::bytestream::WriteResponse* response) override;
  grpc::ServerUnaryReactor* QueryWriteStatus(
      grpc::CallbackServerContext* context,
      const google::bytestream::QueryWriteStatusRequest* request,
      google::bytestream::QueryWriteStatusResponse* response) override;

 private:
  const RpcParts& parts_;
};

// "uploads/{uuid}/blobs/{sha256}/{size_bytes}". Throws Error{kInvalidArgument}.
UploadName ParseUploadName(const std::string& resource);
// "blobs/{sha256}/{size_bytes}". Throws Error{kInvalidArgument}.
FileDigest ParseBlobName(const std::string& resource);

}  // namespace color3d
