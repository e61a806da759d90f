#include "server/net/listen_sockets.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <string_view>

#include "core/base/error.h"
#include "core/base/text/address.h"

namespace color3d {
namespace {

constexpr int kBacklog = 4096;  // capped by the kernel at net.core.somaxconn
constexpr int kType = SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC;
constexpr unsigned kUserTimeoutMs = 20'000;  // for unacknowledged bytes
constexpr int kPortTries = 8;

Error CannotListen(const std::string& address, const std::string& why) {
  return Error(ErrorCode::kFailedPrecondition,
               "cannot listen on {}: {}; choose another with --listen",
               address,
               why);
}

std::string BindErrorText(int error) {
  return error == EADDRINUSE ? "the address is in use (is another server running?)"
                             : std::strerror(error);
}

int BoundPort(int fd) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(address).sin6_port
                                             : reinterpret_cast<sockaddr_in&>(address).sin_port);
}

void SetPort(addrinfo* where, int port) {
  (where->ai_family == AF_INET6 ? reinterpret_cast<sockaddr_in6*>(where->ai_addr)->sin6_port
                                : reinterpret_cast<sockaddr_in*>(where->ai_addr)->sin_port) =
      htons(static_cast<uint16_t>(port));
}

// Accepted sockets inherit the options. Returns -1 and sets errno on failure.
int Listen(const addrinfo& where, bool both_families) {
  const int fd = ::socket(where.ai_family, kType, 0);
  if (fd < 0) return -1;
  const int on = 1, off = 0;
  ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  ::setsockopt(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &kUserTimeoutMs, sizeof(kUserTimeoutMs));
  if (where.ai_family == AF_INET6) {
    const int& only = both_families ? off : on;
    ::setsockopt(fd, IPPROTO_IPV6, IPV6_V6ONLY, &only, sizeof(only));
  }
  if (::bind(fd, where.ai_addr, where.ai_addrlen) == 0 && ::listen(fd, kBacklog) == 0) return fd;
  const int error = errno;
  ::close(fd);
  errno = error;
  return -1;
}

// Returns whether a server accepts connections there; does not throw.
bool IsAlive(const sockaddr_un& address) {
  const int fd = ::socket(AF_UNIX, kType, 0);
  if (fd < 0) return true;
  const bool reached =
      ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  const int error = errno;
  ::close(fd);
  return reached || (error != ECONNREFUSED && error != ENOENT);
}

}  // namespace

ListenSockets::ListenSockets(const std::string& address) : address_(address) {
  try {
    address.starts_with("unix:") ? ListenOnUnix() : ListenOnTcp();
  } catch (...) {
    Close();
    throw;
  }
}

ListenSockets::~ListenSockets() { Close(); }

void ListenSockets::Close() {
  struct stat status {};
  // Keeps a socket that another server has created since.
  if (inode_ != 0 && ::stat(path_.c_str(), &status) == 0 && status.st_ino == inode_) {
    ::unlink(path_.c_str());
  }
  for (const int fd : descriptors_) ::close(fd);
  descriptors_.clear();
  // The lock file stays, so that a waiting server does not lock a deleted file.
  if (lock_ >= 0) ::close(lock_);
  lock_ = -1;
}

void ListenSockets::ListenOnUnix() {
  path_ = address_.substr(std::string_view("unix:").size());
  if (path_.starts_with("//")) path_.erase(0, 2);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.empty()) throw CannotListen(address_, "the path is empty");
  if (path_.size() >= sizeof(address.sun_path)) {
    throw CannotListen(address_,
                       fmt::format("the path has {1} bytes; at most {0} are allowed",
                                   sizeof(address.sun_path) - 1,
                                   path_.size()));
  }
  std::memcpy(address.sun_path, path_.data(), path_.size());
  // If two servers start at once, one gets the lock; probing the socket would not suffice.
  lock_ = ::open((path_ + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (lock_ < 0) throw CannotListen(address_, std::strerror(errno));
  struct stat status {};
  const bool is_there = ::lstat(path_.c_str(), &status) == 0;
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0 ||
      (is_there && S_ISSOCK(status.st_mode) && IsAlive(address))) {
    throw CannotListen(address_, "another server listens there");
  }
  if (is_there && !S_ISSOCK(status.st_mode)) {
    throw CannotListen(address_, "the path is a file but not a socket");
  }
  if (is_there && ::unlink(path_.c_str()) != 0) {
    throw CannotListen(address_,
                       fmt::format("the old socket cannot be removed: {}", std::strerror(errno)));
  }
  const int fd = ::socket(AF_UNIX, kType, 0);
  if (fd < 0) throw CannotListen(address_, std::strerror(errno));
  descriptors_.push_back(fd);
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
      ::listen(fd, kBacklog) != 0) {
    throw CannotListen(address_, BindErrorText(errno));
  }
  if (::stat(path_.c_str(), &status) == 0) inode_ = status.st_ino;
}

void ListenSockets::ListenOnTcp() {
  const HostPort parts = SplitHostPort(address_);
  const bool everywhere = parts.host == "0.0.0.0" || parts.host == "::";
  int port = 0, error = 0;
  for (int tries = 0; port == 0 && tries < kPortTries; ++tries) {
    port = BindAll(everywhere ? "::" : parts.host, parts.port, everywhere, &error);
    // The machine has no IPv6.
    if (port == 0 && everywhere) port = BindAll("0.0.0.0", parts.port, false, &error);
    if (error != EADDRINUSE || parts.port != "0") break;
  }
  if (port == 0) throw CannotListen(address_, BindErrorText(error));
  address_ = address_.substr(0, address_.rfind(':') + 1) + std::to_string(port);
}

int ListenSockets::BindAll(const std::string& host,
                           const std::string& port,
                           bool both_families,
                           int* error) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* first = nullptr;
  const int failed = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &first);
  if (failed != 0) throw CannotListen(address_, ::gai_strerror(failed));
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> found(first, &::freeaddrinfo);
  int bound_port = 0;
  *error = 0;
  for (addrinfo* where = first; where != nullptr; where = where->ai_next) {
    if (bound_port != 0) SetPort(where, bound_port);  // same port on each address
    const int fd = Listen(*where, both_families);
    if (fd >= 0) {
      descriptors_.push_back(fd);
      bound_port = BoundPort(fd);
      continue;
    }
    *error = errno;
    if (*error != EADDRINUSE) continue;  // address family not available on this machine
    for (const int other : descriptors_) ::close(other);
    descriptors_.clear();
    return 0;
  }
  return bound_port;
}

}  // namespace color3d
