// TCP proxy that simulates a bad network. Each connection has a fate, drawn from the seed, that
// strikes after some time or bytes:
//   cut           both sides see the end
//   slow          every piece is delayed, then the connection is cut
//   half open     all bytes of one direction are lost without notice
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/base/random.h"

namespace color3d::testing {

class CuttingProxy {
 public:
  // Listens on a free port of the loopback address.
  explicit CuttingProxy(uint64_t seed);
  // Ends all connections.
  ~CuttingProxy();
  CuttingProxy(const CuttingProxy&) = delete;
  CuttingProxy& operator=(const CuttingProxy&) = delete;

  // 127.0.0.1:PORT
  const std::string& address() const { return address_; }
  // Sets the target of new connections, HOST:PORT; until then they are refused.
  void SetTarget(const std::string& address);
  // Number of connections with each fate.
  std::map<std::string, int> Fates();

 private:
  struct Fate {
    std::string name;
    int64_t after_bytes = 0;
    int after_ms = 0;
    int delay_ms = 0;    // delay of each piece
    int swallowed = -1;  // half open: lost direction, 0 from the client, 1 from the server
  };

  void Accept();
  void Carry(int client, int server, const Fate& fate);
  Fate DrawFate();
  int ConnectToTarget();

  int listener_ = -1;
  std::string address_;
  std::atomic<bool> stopping_{false};
  std::mutex mutex_;
  int target_port_ = 0;
  Random random_;
  std::map<std::string, int> fates_;  // number of connections with each fate
  std::vector<std::thread> carriers_;
  std::thread acceptor_;
};

}  // namespace color3d::testing
