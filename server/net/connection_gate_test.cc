#include "server/net/connection_gate.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <condition_variable>
#include <memory>
#include <mutex>

#include "core/base/text/address.h"

namespace color3d {
namespace {
using std::chrono::milliseconds;

constexpr milliseconds kSoon{5'000};  // much longer than any step here takes

class GateTest : public ::testing::Test {
 protected:
  ~GateTest() override {
    gate_.reset();
    for (const int fd : clients_) ::close(fd);
    for (const int fd : handed_on_) ::close(fd);
  }
  void Open(const GateLimits& limits) {
    gate_ = std::make_unique<ConnectionGate>(sockets_, limits, [this](int, int fd) {
      std::lock_guard lock(mutex_);
      handed_on_.push_back(fd);
      wake_.notify_all();
    });
    gate_->Open();
  }
  // Returns a connected socket that has sent `text`.
  int Connect(const std::string& text) {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port =
        htons(static_cast<uint16_t>(std::stoi(SplitHostPort(sockets_.address()).port)));
    EXPECT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    EXPECT_EQ(::send(fd, text.data(), text.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(text.size()));
    clients_.push_back(fd);
    return fd;
  }
  bool WaitForHandOver(size_t count) {
    std::unique_lock lock(mutex_);
    return wake_.wait_for(lock, kSoon, [&] { return handed_on_.size() >= count; });
  }
  // Returns whether the server closes the connection within this time.
  static bool IsEnded(int client, milliseconds within) {
    pollfd look{client, POLLRDHUP, 0};
    return ::poll(&look, 1, static_cast<int>(within.count())) == 1;
  }
  static std::string NameOf(int client) {
    sockaddr_storage address{};
    socklen_t size = sizeof(address);
    ::getsockname(client, reinterpret_cast<sockaddr*>(&address), &size);
    return PeerName(address);
  }

  const ListenSockets sockets_{"127.0.0.1:0"};
  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<int> handed_on_, clients_;
  std::unique_ptr<ConnectionGate> gate_;
};

TEST_F(GateTest, ClosesSilentConnectionsToMakeRoom) {
  GateLimits limits;
  limits.max_connections = 16;
  Open(limits);
  const int first = Connect("");
  for (int i = 0; i < 200; ++i) Connect("");
  Connect("x");
  EXPECT_TRUE(WaitForHandOver(1));
  EXPECT_TRUE(IsEnded(first, kSoon));
  EXPECT_EQ(gate_->counts().refused, 0);
  EXPECT_LE(gate_->counts().silent + gate_->counts().open, 16);
}

TEST_F(GateTest, HandsOnBeforeFirstBytesWhileFewAreOpen) {
  GateLimits limits;
  limits.handed_on_at_once = 2;
  Open(limits);
  Connect(""), Connect("");
  EXPECT_TRUE(WaitForHandOver(2));
  Connect("");
  EXPECT_FALSE(IsEnded(Connect("x"), milliseconds(0)));
  EXPECT_TRUE(WaitForHandOver(3)) << "the connection that sent bytes, not the silent one";
}

TEST_F(GateTest, ClosesSilentConnections) {
  GateLimits limits;
  limits.silence = milliseconds(100);
  Open(limits);
  const int silent = Connect("");
  EXPECT_TRUE(IsEnded(silent, kSoon));
}

TEST_F(GateTest, ClosesOnlyConnectionsWithoutCall) {
  GateLimits limits;
  limits.max_connections = 8;
  Open(limits);
  const int busy = Connect("x");
  ASSERT_TRUE(WaitForHandOver(1));
  gate_->BeginCall(NameOf(busy));
  const int idle = Connect("x");
  for (size_t i = 0; i < 40; ++i) {
    Connect("x");
    ASSERT_TRUE(WaitForHandOver(3 + i)) << "no room for connection " << i;
  }
  EXPECT_TRUE(IsEnded(idle, kSoon));
  EXPECT_FALSE(IsEnded(busy, milliseconds(0)));
  EXPECT_EQ(gate_->counts().refused, 0);
  // Its call has ended: it is closed like the others, once it has been idle for longest.
  gate_->EndCall(NameOf(busy));
  for (size_t i = 0; i < 40 && !IsEnded(busy, milliseconds(1)); ++i) {
    Connect("x");
    ASSERT_TRUE(WaitForHandOver(43 + i));
    gate_->BeginCall(NameOf(clients_.back()));
    if (i % 6 != 5) gate_->EndCall(NameOf(clients_.back()));
  }
  EXPECT_TRUE(IsEnded(busy, kSoon));
}

TEST_F(GateTest, RefusesWhenAllConnectionsHaveCalls) {
  GateLimits limits;
  limits.max_connections = 4;
  Open(limits);
  for (size_t i = 0; i < 4; ++i) {
    gate_->BeginCall(NameOf(Connect("x")));
    ASSERT_TRUE(WaitForHandOver(i + 1));
  }
  EXPECT_TRUE(IsEnded(Connect(""), kSoon));
  EXPECT_GT(gate_->counts().refused, 0);
  EXPECT_FALSE(IsEnded(clients_.front(), milliseconds(0)));
  ::close(handed_on_.front());
  handed_on_.erase(handed_on_.begin());
  gate_->EndCall(NameOf(clients_.front()));
  Connect("x");
  EXPECT_TRUE(WaitForHandOver(4)) << "closed connections are not counted";
}

TEST(PeerNameTest, EqualsNameOfGrpc) {
  sockaddr_storage address{};
  auto& v4 = reinterpret_cast<sockaddr_in&>(address);
  v4.sin_family = AF_INET;
  v4.sin_port = htons(4000);
  v4.sin_addr.s_addr = htonl(0x0a000001);
  EXPECT_EQ(PeerName(address), "ipv4:10.0.0.1:4000");
  auto& v6 = reinterpret_cast<sockaddr_in6&>(address);
  address = {};
  v6.sin6_family = AF_INET6;
  v6.sin6_port = htons(4000);
  v6.sin6_addr = IN6ADDR_LOOPBACK_INIT;
  EXPECT_EQ(PeerName(address), "ipv6:%5B::1%5D:4000");
  ::inet_pton(AF_INET6, "::ffff:10.0.0.1", &v6.sin6_addr);
  EXPECT_EQ(PeerName(address), "ipv4:10.0.0.1:4000");
  address.ss_family = AF_UNIX;
  EXPECT_EQ(PeerName(address), "unix:");
}

TEST(GateLimitsTest, KeepsReserveOfDescriptors) {
  const GateLimits few = GateLimitsFor(1024, 512, 4096);
  EXPECT_EQ(few.max_connections, 512);
  EXPECT_LT(few.highest_descriptor, 1000);
  EXPECT_EQ(GateLimitsFor(65536, 512, 4096).max_connections, 4096);
  EXPECT_EQ(GateLimitsFor(256, 512, 4096).max_connections, 64);
}

}  // namespace
}  // namespace color3d
