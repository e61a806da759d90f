#include "tests/support/service/cutting_proxy.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>

namespace color3d::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr int kTickMs = 20;
constexpr size_t kPieceBytes = 16 << 10;

sockaddr_in Loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

bool SendAll(int socket, const char* bytes, ssize_t size) {
  while (size > 0) {
    const ssize_t sent = ::send(socket, bytes, static_cast<size_t>(size), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes += sent;
    size -= sent;
  }
  return true;
}

}  // namespace

CuttingProxy::CuttingProxy(uint64_t seed) : random_(seed, /*stream=*/1) {
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = Loopback(0);
  socklen_t size = sizeof(address);
  if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      ::listen(listener_, 64) != 0 ||
      ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw std::runtime_error("the proxy cannot listen");
  }
  address_ = fmt::format("127.0.0.1:{}", ntohs(address.sin_port));
  acceptor_ = std::thread([this] { Accept(); });
}

CuttingProxy::~CuttingProxy() {
  stopping_ = true;
  acceptor_.join();
  for (std::thread& carrier : carriers_) carrier.join();
  ::close(listener_);
}

void CuttingProxy::SetTarget(const std::string& address) {
  std::lock_guard lock(mutex_);
  target_port_ = std::stoi(address.substr(address.rfind(':') + 1));
}

std::map<std::string, int> CuttingProxy::Fates() {
  std::lock_guard lock(mutex_);
  return fates_;
}

CuttingProxy::Fate CuttingProxy::DrawFate() {
  std::lock_guard lock(mutex_);
  Fate fate;
  fate.after_bytes = random_.NextBelow(2 << 20);
  fate.after_ms = 100 + static_cast<int>(random_.NextBelow(3000));
  switch (random_.NextBelow(6)) {
    case 0:
      fate.name = "half open";
      fate.swallowed = static_cast<int>(random_.NextBelow(2));
      break;
    case 1:
      fate.name = "slow, then cut";
      fate.delay_ms = 1 + static_cast<int>(random_.NextBelow(30));
      break;
    default:
      fate.name = "cut";
  }
  return fate;
}

int CuttingProxy::ConnectToTarget() {
  const int server = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::unique_lock lock(mutex_);
  const sockaddr_in address = Loopback(target_port_);
  lock.unlock();
  if (::connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) {
    return server;
  }
  ::close(server);
  return -1;
}

void CuttingProxy::Accept() {
  while (!stopping_) {
    pollfd ready{listener_, POLLIN, 0};
    if (::poll(&ready, 1, kTickMs) != 1) continue;
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) continue;
    const int server = ConnectToTarget();
    if (server < 0) {
      ::close(client);
      continue;
    }
    carriers_.emplace_back([this, client, server, fate = DrawFate()] {
      Carry(client, server, fate);
      ::close(client);
      ::close(server);
    });
  }
}

// Returns when the connection has ended.
void CuttingProxy::Carry(int client, int server, const Fate& fate) {
  const auto due = steady_clock::now() + milliseconds(fate.after_ms);
  std::vector<char> piece(kPieceBytes);
  int64_t carried = 0;
  bool has_come = false;
  pollfd ready[] = {{client, POLLIN, 0}, {server, POLLIN, 0}};
  while (!stopping_) {
    if (!has_come && (carried > fate.after_bytes || steady_clock::now() > due)) {
      has_come = true;
      std::lock_guard lock(mutex_);
      ++fates_[fate.name];
    }
    if (has_come && fate.swallowed < 0) return;
    if (::poll(ready, 2, kTickMs) <= 0) continue;
    for (int from = 0; from < 2; ++from) {
      if (ready[from].revents == 0) continue;
      const ssize_t size = ::recv(ready[from].fd, piece.data(), piece.size(), 0);
      if (size <= 0) return;
      carried += size;
      if (has_come && fate.swallowed == from) continue;
      std::this_thread::sleep_for(milliseconds(fate.delay_ms));
      if (!SendAll(ready[1 - from].fd, piece.data(), size)) return;
    }
  }
}

}  // namespace color3d::testing
