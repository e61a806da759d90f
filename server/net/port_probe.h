// Checks whether a server answers at its address, as its clients see it. Does not use gRPC, so that
// the state of this process does not affect the result.
#pragma once

#include <chrono>
#include <string>

namespace color3d {

struct ProbeTarget {
  std::string address;  // HOST:PORT of this machine, or unix:PATH
  bool tls = false;     // the certificate is not verified
};

// Calls grpc.health.v1 there; any answer counts, also the demand for a client certificate. Returns
// an empty string if the server answered, else the reason: "Connection refused", ...
std::string ProbePort(const ProbeTarget& target, std::chrono::milliseconds limit);

}  // namespace color3d
