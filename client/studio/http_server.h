// HTTP for one user on loopback: cpp-httplib with bounds on connections, times and bodies. One
// request per connection. Thread-safe.
#pragma once

#include <chrono>
#include <cstdint>

#include "client/studio/http_library.h"

namespace color3d::client {

struct HttpLimits {
  int threads = 16;  // requests at a time, event streams included
  int waiting = 64;  // connections that wait for a thread; any more are answered 503
  // Until the head of a request has arrived, and for a body in addition to its bytes at
  // `least_bytes_per_s`.
  std::chrono::milliseconds patience{10'000};
  double least_bytes_per_s = 64 << 10;
};

class HttpServer : public httplib::Server {
 public:
  explicit HttpServer(const HttpLimits& limits);

  // Listens on 127.0.0.1; 0: any free port. Returns the port, or -1 if it is in use.
  int Bind(int port);
  // Ends waiting reads and writes; event streams look at it.
  void Stop();
  bool is_stopping() const { return stopping_; }

 private:
  bool process_and_close_socket(socket_t socket) override;

  const HttpLimits limits_;
  std::atomic<bool> stopping_{false};
};

}  // namespace color3d::client
