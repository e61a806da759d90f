// JobService.ReadJobLog: a job's log file, read on as it grows.
#pragma once

#include <grpcpp/support/server_callback.h>

#include "color3d/v1/job.pb.h"
#include "server/rpc/calls/rpc_parts.h"

namespace color3d {

// A reactor that owns itself.
grpc::ServerWriteReactor<v1::JobLogChunk>* StreamJobLog(const RpcParts& parts,
                                                        const grpc::CallbackServerContext& context,
                                                        const v1::ReadJobLogRequest& request);

}  // namespace color3d
