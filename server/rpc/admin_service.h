// color3d.v1.AdminService.
#pragma once

#include <grpcpp/impl/service_type.h>

#include <memory>

#include "server/rpc/calls/rpc_parts.h"

namespace color3d {

std::unique_ptr<grpc::Service> MakeAdminService(const RpcParts& parts);

}  // namespace color3d
