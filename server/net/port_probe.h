// Whether a server answers at its address: what its clients would see. No gRPC of this process is
// used, so that the answer is not its own opinion.
#pragma once

#include <chrono>
#include <string>

namespace color3d {

struct ProbeTarget {
  std::string address;  // HOST:PORT of this machine, or unix:PATH
  bool tls = false;     // whose certificate it is, is not asked
};

// Makes a call of grpc.health.v1 there; any answer to it will do. A server that wants a certificate
// answers by asking for it. Empty when it answered; else why not: "Connection refused", ...
std::string ProbePort(const ProbeTarget& target, std::chrono::milliseconds limit);

}  // namespace color3d
