// color3d.v1.SceneService.
#pragma once

#include <grpcpp/impl/service_type.h>

#include <memory>

#include "server/rpc/calls/rpc_parts.h"

namespace color3d {

std::unique_ptr<grpc::Service> MakeSceneService(const RpcParts& parts);

}  // namespace color3d
