// color3d.v1.ColorizerService and color3d.v1.ServerService.
#pragma once

#include <grpcpp/impl/service_type.h>

#include <memory>

#include "server/rpc/calls/rpc_parts.h"
#include "server/rpc/live/colorize_hub.h"

namespace color3d {

std::unique_ptr<grpc::Service> MakeColorizerService(const RpcParts& parts, ColorizeHub& hub);
std::unique_ptr<grpc::Service> MakeServerService(const RpcParts& parts);

}  // namespace color3d
