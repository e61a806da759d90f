// TCP proxy that cuts each connection after a number of bytes, counted in both directions.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace color3d::testing {

class ByteLimitProxy {
 public:
  // `target`: 127.0.0.1:PORT.
  ByteLimitProxy(const std::string& target, int64_t bytes)
      : target_port_(std::stoi(target.substr(target.rfind(':') + 1))), limit_(bytes) {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = Loopback(0);
    ::bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof(address));
    ::listen(listener_, 16);
    socklen_t size = sizeof(address);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
    acceptor_ = std::thread([this] { Accept(); });
  }
  ~ByteLimitProxy() {
    stopping_ = true;
    acceptor_.join();
    for (std::thread& carrier : carriers_) carrier.join();
    ::close(listener_);
  }
  ByteLimitProxy(const ByteLimitProxy&) = delete;
  ByteLimitProxy& operator=(const ByteLimitProxy&) = delete;

  const std::string& address() const { return address_; }
  int cuts() const { return cuts_; }

 private:
  static sockaddr_in Loopback(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<uint16_t>(port));
    return address;
  }

  void Accept() {
    while (!stopping_) {
      pollfd look{listener_, POLLIN, 0};
      if (::poll(&look, 1, 20) != 1) continue;
      const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      carriers_.emplace_back([this, client] { Carry(client); });
    }
  }

  void Carry(int client) {
    const int server = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = Loopback(target_port_);
    bool open = ::connect(server, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
    int64_t left = limit_;
    std::array<pollfd, 2> ends{pollfd{client, POLLIN, 0}, pollfd{server, POLLIN, 0}};
    while (open && !stopping_) {
      if (::poll(ends.data(), ends.size(), 20) <= 0) continue;
      for (size_t from = 0; from < 2 && open; ++from) {
        if ((ends[from].revents & (POLLIN | POLLHUP | POLLERR)) == 0) continue;
        std::array<char, 16384> data;
        const ssize_t got = ::read(ends[from].fd, data.data(), data.size());
        open =
            got > 0 && (left -= got) > 0 &&
            ::send(ends[1 - from].fd, data.data(), static_cast<size_t>(got), MSG_NOSIGNAL) == got;
        if (left <= 0) ++cuts_;
      }
    }
    ::close(client);
    ::close(server);
  }

  const int target_port_;
  const int64_t limit_;
  int listener_ = -1;
  std::string address_;
  std::atomic<bool> stopping_{false};
  std::atomic<int> cuts_{0};
  std::vector<std::thread> carriers_;  // acceptor's thread, then the destructor
  std::thread acceptor_;
};

}  // namespace color3d::testing
