// color3d.internal.v1.WorkerService: the job store and the blobs for workers.
#pragma once

#include <grpcpp/impl/service_type.h>

#include <memory>

#include "server/rpc/calls/rpc_parts.h"

namespace color3d {

enum class WorkerPlace {
  kHere,       // processes of this server, over its private socket: not authenticated
  kElsewhere,  // other machines: callers with the role worker
};

// `memory` accounts for the calls of the service.
std::unique_ptr<grpc::Service> MakeWorkerService(const RpcParts& parts,
                                                 WorkerPlace place,
                                                 CallMemory& memory);

}  // namespace color3d
