// Gives each call an id in its trailers and a line in the log, and reports it to observers. A gRPC
// interceptor; thread-safe.
#pragma once

#include <grpcpp/support/server_interceptor.h>
#include <grpcpp/support/status_code_enum.h>

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "core/trace/tracer.h"

namespace color3d {

// Called when a call has ended. `method`: e.g. "/color3d.v1.JobService/GetJob".
using CallObserver =
    std::function<void(const std::string& method, grpc::StatusCode code, double seconds)>;

// "OK", "NOT_FOUND", ...
const char* StatusName(grpc::StatusCode code);

// Returns the client's "x-request-id" if it is 1 to 64 letters, digits, '-', '_' or '.', else a new
// id.
std::string ChooseRequestId(std::string_view header);

// Called at the begin and the end of each call, except those of gRPC's own services. `peer`: as
// named by gRPC.
struct PeerObserver {
  std::function<void(const std::string&peer)> on_begin, on_end;
};

// Trailers of each call carry "x-request-id" (ChooseRequestId). Observers may be empty. `tracer`
// records a span of each call but those of gRPC's own services and of workers, and may be null. The
// service finds that span, or else that of its caller, as "traceparent" in the client's metadata.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeCallWatch(
    CallObserver observer, PeerObserver peers = {}, std::shared_ptr<Tracer> tracer = nullptr);

}  // namespace color3d
