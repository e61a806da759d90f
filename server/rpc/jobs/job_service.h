// color3d.v1.JobService.
#pragma once

#include <grpcpp/impl/service_type.h>

#include <memory>

#include "server/rpc/calls/rpc_parts.h"
#include "server/rpc/jobs/watch_hub.h"

namespace color3d {

std::unique_ptr<grpc::Service> MakeJobService(const RpcParts& parts, WatchHub& hub);

}  // namespace color3d
