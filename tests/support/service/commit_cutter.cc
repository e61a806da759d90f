#include "tests/support/service/commit_cutter.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <string_view>

namespace color3d::testing {
namespace {

constexpr int kLookMs = 20;

sockaddr_un AddressOfSocket(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
  return address;
}

bool IsReadable(int fd) {
  pollfd wait{fd, POLLIN, 0};
  return ::poll(&wait, 1, kLookMs) > 0;
}

// Sends what can be read from one to the other; returns it, or nothing at the end.
std::string Receive(int from) {
  std::array<char, 65536> bytes;
  const ssize_t size = ::recv(from, bytes.data(), bytes.size(), 0);
  return size > 0 ? std::string(bytes.data(), static_cast<size_t>(size)) : std::string();
}

bool SendAll(int to, const std::string& bytes) {
  size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t size = ::send(to, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
    if (size <= 0) return false;
    done += static_cast<size_t>(size);
  }
  return true;
}

// A message of the type "query" that ends with "commit".
bool IsCommit(const std::string& bytes) {
  return bytes.starts_with("Q") && bytes.ends_with(std::string_view("commit\0", 7));
}

}  // namespace

CommitCutter::CommitCutter(const std::filesystem::path& folder,
                           std::filesystem::path server,
                           int every)
    : server_(std::move(server)),
      every_(every),
      listener_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const sockaddr_un own = AddressOfSocket(folder / ".s.PGSQL.5432");
  static_cast<void>(::bind(listener_, reinterpret_cast<const sockaddr*>(&own), sizeof(own)));
  ::listen(listener_, 64);
  acceptor_ = std::thread([this] { Accept(); });
}

CommitCutter::~CommitCutter() {
  stopping_ = true;
  acceptor_.join();
  for (std::thread& carrier : carriers_) carrier.join();
  ::close(listener_);
}

void CommitCutter::Accept() {
  while (!stopping_) {
    if (!IsReadable(listener_)) continue;
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client >= 0) carriers_.emplace_back([this, client] { Carry(client); });
  }
}

CommitCutter::Cut CommitCutter::Next() {
  const int number = ++commits_;
  if (number % every_ != 0) return Cut::kNone;
  switch (number / every_ % 3) {
    case 0:
      ++before_;
      return Cut::kBefore;
    case 1:
      ++after_;
      return Cut::kAfter;
    default:
      ++during_;
      return Cut::kDuring;
  }
}

void CommitCutter::Carry(int client) {
  const int server = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_un address = AddressOfSocket(server_);
  bool is_open =
      ::connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  while (is_open && !stopping_) {
    pollfd waits[] = {{client, POLLIN, 0}, {server, POLLIN, 0}};
    if (::poll(waits, 2, kLookMs) <= 0) continue;
    if (waits[1].revents != 0) {
      const std::string bytes = Receive(server);
      is_open = !bytes.empty() && SendAll(client, bytes);
    }
    if (is_open && waits[0].revents != 0) {
      const std::string bytes = Receive(client);
      const Cut cut = IsCommit(bytes) ? Next() : Cut::kNone;
      is_open = !bytes.empty() && cut != Cut::kBefore && SendAll(server, bytes);
      if (cut == Cut::kAfter) Receive(server);
      if (cut != Cut::kNone) is_open = false;
    }
  }
  ::close(client);
  ::close(server);
}

}  // namespace color3d::testing
