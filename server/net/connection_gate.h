// Accepts the connections of a server and bounds their number. Hands those that send bytes on to
// gRPC, which would stop listening for good when it runs out of descriptors. To make room for new
// connections it closes silent ones, then idle ones, but never a connection with a call. Runs one
// thread. Thread-safe.
#pragma once

#include <sys/socket.h>
#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "core/base/mutex.h"
#include "server/net/listen_sockets.h"

namespace color3d {

struct GateLimits {
  int max_connections = 4096;
  // While fewer connections are open, a new one is handed on before its first bytes. gRPC then
  // sends its settings at once; clients that poll rarely (gRPC's own, between two calls) need them
  // to connect in time.
  int handed_on_at_once = 0;
  // An accepted socket gets the lowest free descriptor, so a number at or above this limit means
  // that as many descriptors are in use, and room is made.
  int highest_descriptor = 1 << 30;
  // A connection that sends nothing for this time is closed.
  std::chrono::milliseconds silence{10'000};
};

// Returns the limits for a process with `descriptors`, of which `reserve` are needed for other
// things than connections. Connections get at least a quarter.
GateLimits GateLimitsFor(int64_t descriptors, int64_t reserve, int max_connections);

// Returns the name of a peer in gRPC's format: "ipv4:127.0.0.1:40000", "ipv6:%5B::1%5D:40000",
// "unix:".
std::string PeerName(const sockaddr_storage& address);

class ConnectionGate {
 public:
  // Takes ownership of the accepted socket `fd`.
  using Sink = std::function<void(int listener, int fd)>;
  // Accepts nothing until Open(). The sockets must outlive the gate.
  ConnectionGate(const ListenSockets& sockets, const GateLimits& limits, Sink sink);
  ~ConnectionGate();
  ConnectionGate(const ConnectionGate&) = delete;
  ConnectionGate& operator=(const ConnectionGate&) = delete;

  // Starts to accept.
  void Open();
  // Stops accepting and closes silent connections.
  void Stop();

  // A connection with calls is never closed to make room. All connections of a Unix socket share
  // one name: while one of them has a call, none is closed.
  void BeginCall(const std::string& peer);
  void EndCall(const std::string& peer);

  struct Counts {
    int64_t open = 0;    // connections handed on
    int64_t silent = 0;  // connections that have sent nothing yet
    int64_t max = 0;     // limit of both together
    // Since the start.
    int64_t closed = 0;   // to make room
    int64_t refused = 0;  // for lack of room
  };
  Counts counts() const;

 private:
  using SteadyClock = std::chrono::steady_clock;
  struct Silent {
    int listener = -1, fd = -1;
    SteadyClock::time_point since;
  };
  // A connection that was handed on. gRPC owns it; its descriptor with another inode is another
  // file.
  struct Connection {
    int fd = -1;
    ino_t inode = 0;
    std::string peer;
    SteadyClock::time_point since;
  };
  struct Calls {
    int open = 0;
    SteadyClock::time_point last_end;
  };

  void Loop();
  // Returns false if the machine has no free descriptor.
  bool Accept(int listener);
  void OnBytes(int fd);
  void HandOn(const Silent& silent);
  void CloseSilent(std::list<Silent>::iterator silent);
  void CloseLongSilent();
  void ForgetClosed();
  // Returns whether there is room for one more connection, after closing others if necessary.
  bool MakeRoom(int fd);
  // Closes the connection that has been silent for longest, or else idle ones. Returns false if
  // there is none.
  bool CloseOneOrMore();
  bool CloseIdle();
  void LogRefusal(const char* why);
  void Publish();

  const std::vector<int> listeners_;
  const GateLimits limits_;
  const Sink sink_;
  int epoll_ = -1, stop_ = -1;
  // Used by the thread only.
  std::list<Silent> silent_;  // oldest first
  std::unordered_map<int, std::list<Silent>::iterator> silent_of_;
  std::vector<Connection> open_;
  SteadyClock::time_point next_look_, last_refusal_;

  mutable Mutex mutex_;
  std::unordered_map<std::string, Calls> calls_ COLOR3D_GUARDED_BY(mutex_);  // by peer
  Counts counts_ COLOR3D_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace color3d
