// The door of a server that keeps connections for long: accepts them, hands those that say
// something on to who answers (gRPC, which stops to listen for ever when it runs out of
// descriptors), and sees to it that there are never more than may be, so that whoever comes next
// finds room. What says nothing, and what has no call open, makes room first; a connection with a
// call is never closed. One thread of its own. Thread-safe.
#pragma once

#include <sys/socket.h>
#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "server/net/listen_sockets.h"

namespace color3d {

struct GateLimits {
  int max_connections = 4096;
  // While fewer connections are open, a new one is handed on before its first bytes: gRPC then
  // sends its settings at once, which clients that poll seldom (gRPC's own, between two calls) need
  // in order to connect in time.
  int handed_on_at_once = 0;
  // An accepted socket has the lowest free number, so that this many descriptors below it are in
  // use; from here on room is made, whatever uses them.
  int highest_descriptor = 1 << 30;
  // A connection that has said nothing for so long is closed.
  std::chrono::milliseconds silence{10'000};
};

// For a process that may have `descriptors` and needs `reserve` for other things than connections.
// A quarter is for connections in any case.
GateLimits GateLimitsFor(int64_t descriptors, int64_t reserve, int max_connections);

// Who is at the other end, as gRPC says it: "ipv4:127.0.0.1:40000", "ipv6:%5B::1%5D:40000",
// "unix:".
std::string PeerName(const sockaddr_storage& address);

class ConnectionGate {
 public:
  // Takes the accepted socket `fd` over, and closes it when it ends.
  using Sink = std::function<void(int listener, int fd)>;
  // Closed until Open(). The sockets outlive the gate.
  ConnectionGate(const ListenSockets& sockets, const GateLimits& limits, Sink sink);
  ~ConnectionGate();
  ConnectionGate(const ConnectionGate&) = delete;
  ConnectionGate& operator=(const ConnectionGate&) = delete;

  // Accepts from now on.
  void Open();
  // Accepts no more; those that have said nothing are closed.
  void Stop();

  // A connection with calls is not closed to make room. All of a Unix socket are alike: while one
  // has a call none is closed.
  void BeginCall(const std::string& peer);
  void EndCall(const std::string& peer);

  struct Counts {
    int64_t open = 0, silent = 0;     // connections that were handed on, and that wait to be
    int64_t max = 0;                  // of both
    int64_t closed = 0, refused = 0;  // since the start: to make room, and for want of it
  };
  Counts counts() const;

 private:
  using SteadyClock = std::chrono::steady_clock;
  struct Silent {
    int listener = -1, fd = -1;
    SteadyClock::time_point since;
  };
  // Handed on. It is not ours any more: what has its number and another inode is something else.
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
  // False: the machine has no descriptor for it.
  bool Accept(int listener);
  void OnBytes(int fd);
  void HandOn(const Silent& silent);
  void CloseSilent(std::list<Silent>::iterator silent);
  void CloseLongSilent();
  void ForgetClosed();
  // Whether there is room for one more, after what could be closed was.
  bool MakeRoom(int fd);
  // The one that has been silent for longest, or else idle ones; false: there is none.
  bool CloseSomething();
  bool CloseIdle();
  void LogRefusal(const char* why);
  void Publish();

  const std::vector<int> listeners_;
  const GateLimits limits_;
  const Sink sink_;
  int epoll_ = -1, stop_ = -1;
  // The thread's own.
  std::list<Silent> silent_;  // the oldest first
  std::unordered_map<int, std::list<Silent>::iterator> silent_of_;
  std::vector<Connection> open_;
  SteadyClock::time_point next_look_, last_refusal_;

  mutable std::mutex mutex_;
  std::unordered_map<std::string, Calls> calls_;  // by peer
  Counts counts_;
  std::thread thread_;
};

}  // namespace color3d
