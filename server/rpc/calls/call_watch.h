// Gives each call an id in its trailers and a line in the log, and reports it to observers. A gRPC
// interceptor; thread-safe.
#pragma once

#include <grpcpp/support/server_interceptor.h>
#include <grpcpp/support/status_code_enum.h>

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace color3d {

// Called when a call has ended. `method`: e.g. "/color3d.v1.JobService/GetJob".
using CallObserver =
    std::function<void(const std::string& method, grpc::StatusCode code, double seconds)>;

// "OK", "NOT_FOUND", ...
const char* StatusName(grpc::StatusCode code);

// Returns the trace id of a W3C "traceparent", 32 hexadecimal digits; empty if it is malformed or
// all zeros. https://www.w3.org/TR/trace-context/
std::string ParseTraceId(std::string_view traceparent);

// Returns the client's "x-request-id" if it is 1 to 64 letters, digits, '-', '_' or '.', else a new
// id.
std::string ChooseRequestId(std::string_view header);

// Called at the begin and the end of each call, except those of gRPC's own services. `peer`: as
// named by gRPC.
struct PeerObserver {
  std::function<void(const std::string&peer)> on_begin, on_end;
};

// Trailers of each call carry "x-request-id" (ChooseRequestId). Observers may be empty.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeCallWatch(
    CallObserver observer, PeerObserver peers = {});

}  // namespace color3d
