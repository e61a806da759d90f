// Streams of blobs in both directions, for clients and for workers. Both reactors hand one chunk at
// a time to the executor, so a stream holds at most one chunk in memory and never blocks a gRPC
// thread.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <functional>
#include <string>

#include "google/bytestream/bytestream.pb.h"
#include "server/rpc/calls/rpc_parts.h"

namespace color3d {

// Which blobs the caller of a stream may read and write.
struct BlobRights {
  std::string owner;  // of its streams and unfinished uploads: a project, or workers
  // Returns whether the caller may read the blob and it is stored; then keeps it for the grace
  // period.
  std::function<bool(const FileDigest&)> has;
  // Throws if the unfinished uploads of the owner may not have this size.
  std::function<void(int64_t owner_bytes)> admit;
  // Called after an upload.
  std::function<void(const FileDigest&)> on_stored;
};
// Throws as Access::Require.
using BlobAdmission = std::function<BlobRights(const grpc::CallbackServerContext&)>;

grpc::ServerWriteReactor<google::bytestream::ReadResponse>* ReadBlob(
    const RpcParts& parts,
    grpc::CallbackServerContext& context,
    const google::bytestream::ReadRequest& request,
    const BlobAdmission& admission);

grpc::ServerReadReactor<google::bytestream::WriteRequest>* WriteBlob(
    const RpcParts& parts,
    const grpc::CallbackServerContext& context,
    google::bytestream::WriteResponse* response,
    const BlobAdmission& admission);

// Answers QueryWriteStatus.
void QueryBlobWrite(const RpcParts& parts,
                    const BlobRights& rights,
                    const google::bytestream::QueryWriteStatusRequest& request,
                    google::bytestream::QueryWriteStatusResponse* response);

}  // namespace color3d
