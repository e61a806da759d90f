#include "server/net/connection_gate.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <spdlog/spdlog.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <unordered_set>

#include "core/base/error.h"

namespace color3d {
namespace {

constexpr int kLookMs = 1'000;
constexpr auto kRefusalLog = std::chrono::seconds(10);
constexpr auto kPause = std::chrono::milliseconds(20);  // when the machine has no free descriptor
constexpr int kAtOnce = 64;      // connections accepted before others are served
constexpr int kCloseShare = 16;  // 1/kCloseShare of all connections are closed at once

// Returns 0 if the descriptor is not in use.
ino_t SocketInode(int fd) {
  struct stat status {};
  return ::fstat(fd, &status) == 0 && S_ISSOCK(status.st_mode) ? status.st_ino : 0;
}

// Shuts down the socket with this descriptor and inode, if it still exists. Other uses of the
// descriptor are not affected.
void EndSocket(int fd, ino_t inode) {
  const int own = ::fcntl(fd, F_DUPFD_CLOEXEC, 0);
  if (own < 0) return;
  if (SocketInode(own) == inode) ::shutdown(own, SHUT_RDWR);
  ::close(own);
}

std::string SocketPeerName(int fd) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (::getpeername(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) return "";
  return PeerName(address);
}

}  // namespace

GateLimits GateLimitsFor(int64_t descriptors, int64_t reserve, int max_connections) {
  GateLimits limits;
  const int64_t room = std::max(descriptors - reserve, descriptors / 4);
  limits.max_connections = static_cast<int>(std::clamp<int64_t>(room, 1, max_connections));
  limits.handed_on_at_once = limits.max_connections / 2;
  limits.highest_descriptor =
      static_cast<int>(descriptors - std::clamp<int64_t>(descriptors / 8, 8, 128));
  return limits;
}

std::string PeerName(const sockaddr_storage& address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address.ss_family == AF_UNIX) return "unix:";
  if (address.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(address);
    ::inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
    return fmt::format("ipv4:{}:{}", text.data(), ntohs(v4.sin_port));
  }
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(address);
  if (IN6_IS_ADDR_V4MAPPED(&v6.sin6_addr)) {
    ::inet_ntop(AF_INET, &v6.sin6_addr.s6_addr[12], text.data(), text.size());
    return fmt::format("ipv4:{}:{}", text.data(), ntohs(v6.sin6_port));
  }
  ::inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
  const std::string scope = v6.sin6_scope_id != 0 ? fmt::format("%25{}", v6.sin6_scope_id) : "";
  return fmt::format("ipv6:%5B{}{}%5D:{}", text.data(), scope, ntohs(v6.sin6_port));
}

ConnectionGate::ConnectionGate(const ListenSockets& sockets, const GateLimits& limits, Sink sink)
    : listeners_(sockets.descriptors()), limits_(limits), sink_(std::move(sink)) {
  epoll_ = ::epoll_create1(EPOLL_CLOEXEC);
  stop_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (epoll_ < 0 || stop_ < 0) {
    throw Error(ErrorCode::kInternal, "cannot wait for connections: {}", std::strerror(errno));
  }
  counts_.max = limits_.max_connections;
  epoll_event event{};
  event.events = EPOLLIN;
  for (const int fd : listeners_) {
    event.data.fd = fd;
    ::epoll_ctl(epoll_, EPOLL_CTL_ADD, fd, &event);
  }
  event.data.fd = stop_;
  ::epoll_ctl(epoll_, EPOLL_CTL_ADD, stop_, &event);
}

ConnectionGate::~ConnectionGate() {
  Stop();
  ::close(stop_);
  ::close(epoll_);
}

void ConnectionGate::Open() {
  thread_ = std::thread([this] { Loop(); });
}

void ConnectionGate::Stop() {
  if (!thread_.joinable()) return;
  ::eventfd_write(stop_, 1);
  thread_.join();
  for (const Silent& silent : silent_) ::close(silent.fd);
  silent_.clear();
  silent_of_.clear();
}

void ConnectionGate::BeginCall(const std::string& peer) {
  const MutexLock lock(mutex_);
  ++calls_[peer].open;
}

void ConnectionGate::EndCall(const std::string& peer) {
  const MutexLock lock(mutex_);
  const auto calls = calls_.find(peer);
  if (calls == calls_.end()) return;
  calls->second.open = std::max(0, calls->second.open - 1);
  calls->second.last_end = SteadyClock::now();
}

ConnectionGate::Counts ConnectionGate::counts() const {
  const MutexLock lock(mutex_);
  return counts_;
}

void ConnectionGate::Publish() {
  const MutexLock lock(mutex_);
  counts_.open = static_cast<int64_t>(open_.size());
  counts_.silent = static_cast<int64_t>(silent_.size());
}

void ConnectionGate::Loop() {
  std::array<epoll_event, 256> events;
  while (true) {
    const int count = ::epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), kLookMs);
    for (int i = 0; i < count; ++i) {
      const int fd = events[static_cast<size_t>(i)].data.fd;
      if (fd == stop_) return;
      const bool is_listener = std::ranges::find(listeners_, fd) != listeners_.end();
      if (!is_listener) OnBytes(fd);
    }
    const auto now = SteadyClock::now();
    if (now >= next_look_) {
      next_look_ = now + std::chrono::milliseconds(kLookMs);
      CloseLongSilent();
      ForgetClosed();
    }
    // Connections that have sent bytes come first, so that long waiting ones precede new ones.
    bool is_short = false;
    for (const int fd : listeners_) is_short = !Accept(fd) || is_short;
    Publish();
    if (is_short) std::this_thread::sleep_for(kPause);
  }
}

bool ConnectionGate::Accept(int listener) {
  for (int i = 0; i < kAtOnce; ++i) {
    const int fd = ::accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0 && (errno == ECONNABORTED || errno == EINTR)) continue;
    if (fd < 0 && (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM)) {
      // A pause only, whereas gRPC would stop listening for good.
      LogRefusal(std::strerror(errno));
      CloseOneOrMore();
      return false;
    }
    if (fd < 0) return true;  // EAGAIN: no pending connection
    if (!MakeRoom(fd)) {
      LogRefusal("all open connections have calls");
      {
        const MutexLock lock(mutex_);
        ++counts_.refused;
      }
      ::close(fd);
      continue;
    }
    if (open_.size() + silent_.size() < static_cast<size_t>(limits_.handed_on_at_once)) {
      HandOn({listener, fd, SteadyClock::now()});
      continue;
    }
    epoll_event event{};
    event.events = EPOLLIN | EPOLLRDHUP;
    event.data.fd = fd;
    if (::epoll_ctl(epoll_, EPOLL_CTL_ADD, fd, &event) != 0) {
      ::close(fd);
      continue;
    }
    silent_.push_back({listener, fd, SteadyClock::now()});
    silent_of_[fd] = std::prev(silent_.end());
  }
  return true;
}

// Most clients send bytes at once, with HTTP/2 and with TLS.
void ConnectionGate::OnBytes(int fd) {
  const auto found = silent_of_.find(fd);
  if (found == silent_of_.end()) return;
  char byte = 0;
  const ssize_t got = ::recv(fd, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (got <= 0) return CloseSilent(found->second);
  const Silent silent = *found->second;
  silent_.erase(found->second);
  silent_of_.erase(found);
  ::epoll_ctl(epoll_, EPOLL_CTL_DEL, fd, nullptr);
  HandOn(silent);
}

void ConnectionGate::HandOn(const Silent& silent) {
  open_.push_back(
      {silent.fd, SocketInode(silent.fd), SocketPeerName(silent.fd), SteadyClock::now()});
  sink_(silent.listener, silent.fd);
}

void ConnectionGate::CloseSilent(std::list<Silent>::iterator silent) {
  ::epoll_ctl(epoll_, EPOLL_CTL_DEL, silent->fd, nullptr);
  ::close(silent->fd);
  silent_of_.erase(silent->fd);
  silent_.erase(silent);
}

void ConnectionGate::CloseLongSilent() {
  const auto long_ago = SteadyClock::now() - limits_.silence;
  while (!silent_.empty() && silent_.front().since < long_ago) CloseSilent(silent_.begin());
}

void ConnectionGate::ForgetClosed() {
  std::erase_if(open_, [](const Connection& one) { return SocketInode(one.fd) != one.inode; });
  std::unordered_set<std::string> peers;
  for (const Connection& one : open_) peers.insert(one.peer);
  const MutexLock lock(mutex_);
  std::erase_if(calls_, [&](const auto& entry) {
    return entry.second.open == 0 && !peers.contains(entry.first);
  });
}

bool ConnectionGate::MakeRoom(int fd) {
  const auto is_full = [&] {
    return open_.size() + silent_.size() >= static_cast<size_t>(limits_.max_connections) ||
           fd >= limits_.highest_descriptor;
  };
  if (!is_full()) return true;
  if (silent_.empty()) ForgetClosed();
  return !is_full() || CloseOneOrMore();
}

bool ConnectionGate::CloseOneOrMore() {
  if (silent_.empty()) return CloseIdle();
  CloseSilent(silent_.begin());
  const MutexLock lock(mutex_);
  ++counts_.closed;
  return true;
}

// Closes connections that never had a call first, then those idle for longest.
bool ConnectionGate::CloseIdle() {
  struct Idle {
    bool had_calls;
    SteadyClock::time_point since;
    size_t index;
  };
  std::vector<Idle> idle;
  MutexLock lock(mutex_);
  for (size_t i = 0; i < open_.size(); ++i) {
    const auto calls = calls_.find(open_[i].peer);
    if (calls == calls_.end()) {
      idle.push_back({false, open_[i].since, i});
    } else if (calls->second.open == 0) {
      idle.push_back({true, calls->second.last_end, i});
    }
  }
  std::ranges::sort(idle, [](const Idle& a, const Idle& b) {
    return a.had_calls != b.had_calls ? b.had_calls : a.since < b.since;
  });
  idle.resize(std::min(idle.size(), open_.size() / kCloseShare + 1));
  counts_.closed += static_cast<int64_t>(idle.size());
  lock.Unlock();
  std::ranges::sort(idle, std::ranges::greater(), &Idle::index);
  for (const Idle& one : idle) {
    EndSocket(open_[one.index].fd, open_[one.index].inode);
    open_.erase(open_.begin() + static_cast<ptrdiff_t>(one.index));
  }
  return !idle.empty();
}

void ConnectionGate::LogRefusal(const char* why) {
  const auto now = SteadyClock::now();
  if (last_refusal_ != SteadyClock::time_point() && now - last_refusal_ < kRefusalLog) return;
  last_refusal_ = now;
  spdlog::warn(
      "connections are refused: {}; {} of at most {} are open: raise --max-connections, or the "
      "limit of open files (ulimit -n, LimitNOFILE)",
      why,
      open_.size(),
      limits_.max_connections);
}

}  // namespace color3d
