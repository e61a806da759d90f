// color3d.v1.BlobService and google.bytestream.ByteStream.
#pragma once

#include <grpcpp/impl/service_type.h>

#include <memory>

#include "server/rpc/calls/rpc_parts.h"

namespace color3d {

std::unique_ptr<grpc::Service> MakeBlobService(const RpcParts& parts);
std::unique_ptr<grpc::Service> MakeByteStreamService(const RpcParts& parts);

// "uploads/{uuid}/blobs/{sha256}/{size_bytes}". Throws Error{kInvalidArgument}.
UploadName ParseUploadName(const std::string& resource);
// "blobs/{sha256}/{size_bytes}". Throws Error{kInvalidArgument}.
FileDigest ParseBlobName(const std::string& resource);

}  // namespace color3d
