// A TCP proxy that treats connections as bad networks do. Each connection has a fate, drawn from
// the seed, that comes over it after some time or some bytes:
//   cut           both sides see it end
//   slow          every piece comes late, and then it is cut
//   half open     one direction swallows all bytes, while nobody is told
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
  // Where connections lead from now on: HOST:PORT; until then they are refused.
  void SetTarget(const std::string& address);
  // How often each has come over a connection.
  std::map<std::string, int> Fates();

 private:
  struct Fate {
    std::string name;
    int64_t after_bytes = 0;
    int after_ms = 0;
    int delay_ms = 0;    // of each piece
    int swallowed = -1;  // half open: 0 what the client sends, 1 what the server sends
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
  std::map<std::string, int> fates_;  // that have come over a connection
  std::vector<std::thread> carriers_;
  std::thread acceptor_;
};

}  // namespace color3d::testing
