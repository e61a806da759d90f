#include "server/net/listen_sockets.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <functional>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/text/address.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string Complaint(const std::string& address) {
  try {
    const ListenSockets sockets(address);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

bool Connects(const sockaddr* address, socklen_t size) {
  const int fd = ::socket(address->sa_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool connected = ::connect(fd, address, size) == 0;
  ::close(fd);
  return connected;
}

bool ConnectsUnix(const fs::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
  return Connects(reinterpret_cast<const sockaddr*>(&address), sizeof(address));
}

bool ConnectsLoopback(const std::string& listening) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<uint16_t>(std::stoi(SplitHostPort(listening).port)));
  return Connects(reinterpret_cast<const sockaddr*>(&address), sizeof(address));
}

TEST(ListenSocketsTest, TcpAddressesAreBoundOnce) {
  for (const char* address : {"127.0.0.1:0", "localhost:0", "0.0.0.0:0"}) {
    SCOPED_TRACE(address);
    const ListenSockets sockets(address);
    EXPECT_THAT(sockets.address(), ::testing::Not(::testing::EndsWith(":0")));
    EXPECT_TRUE(ConnectsLoopback(sockets.address()));
    EXPECT_THAT(Complaint(sockets.address()), HasSubstr("in use"));
  }
  EXPECT_THAT(Complaint("192.0.2.1:0"), HasSubstr("choose another with --listen"));
  EXPECT_THAT(Complaint("no.such.host.invalid:1"), HasSubstr("choose another with --listen"));
}

TEST(ListenSocketsTest, AUnixSocketOfALivingServerIsNotTakenOver) {
  const ScratchFolder scratch;
  const fs::path path = scratch.path() / "s";
  {
    const ListenSockets first("unix:" + path.string());
    EXPECT_THAT(Complaint("unix:" + path.string()), HasSubstr("another server listens there"));
    EXPECT_TRUE(ConnectsUnix(path)) << "the first lost its socket";
  }
  EXPECT_FALSE(fs::exists(path)) << "it is removed at the end";
  EXPECT_EQ(Complaint("unix:" + path.string()), "");
}

// Of another program, or of an older release, which know nothing of the lock.
TEST(ListenSocketsTest, AStaleUnixSocketIsReplacedAndALivingOneIsNot) {
  const ScratchFolder scratch;
  const fs::path path = scratch.path() / "s";
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ASSERT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  ASSERT_EQ(::listen(fd, 1), 0);
  EXPECT_THAT(Complaint("unix:" + path.string()), HasSubstr("another server listens there"));
  EXPECT_TRUE(ConnectsUnix(path));
  ::close(fd);  // as if it was killed
  const ListenSockets sockets("unix:" + path.string());
  EXPECT_TRUE(ConnectsUnix(path));
}

TEST(ListenSocketsTest, FilesAndLongPathsAreNamed) {
  const ScratchFolder scratch;
  const fs::path file = scratch.path() / "file";
  WriteFileAtomic(file, "mine");
  EXPECT_THAT(Complaint("unix:" + file.string()), HasSubstr("no socket"));
  EXPECT_EQ(ReadFile(file), "mine");
  EXPECT_THAT(Complaint("unix:" + (scratch.path() / std::string(120, 'x')).string()),
              HasSubstr("may have 107 bytes"));
  EXPECT_THAT(Complaint("unix:" + (scratch.path() / "none" / "s").string()),
              HasSubstr("No such file"));
  EXPECT_THAT(Complaint("unix:"), HasSubstr("empty"));
}

}  // namespace
}  // namespace color3d
