// What every call of the server has: an id in its trailers, a line in the log, and somebody who
// counts it. A gRPC interceptor; thread-safe.
#pragma once

#include <grpcpp/support/server_interceptor.h>
#include <grpcpp/support/status_code_enum.h>

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace color3d {

// A call has ended: "/color3d.v1.JobService/GetJob", how, after so many seconds.
using CallObserver =
    std::function<void(const std::string& method, grpc::StatusCode code, double seconds)>;

// "OK", "NOT_FOUND", ...
const char* StatusName(grpc::StatusCode code);

// The trace id of a W3C "traceparent", 32 hexadecimal digits; empty for one that is malformed or
// all zeros. https://www.w3.org/TR/trace-context/
std::string TraceIdOf(std::string_view traceparent);

// The client's own "x-request-id" when it is 1 to 64 letters, digits, '-', '_' or '.', else a fresh
// one.
std::string RequestIdOf(std::string_view header);

// Told when a call begins, and when it is over: `peer` as gRPC names it. gRPC's own services, which
// answer everybody, are not among them.
struct PeerObserver {
  std::function<void(const std::string&peer)> on_begin, on_end;
};

// Trailers of each call carry "x-request-id", as RequestIdOf. What observes may be empty.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> MakeCallWatch(
    CallObserver observer, PeerObserver peers = {});

}  // namespace color3d
