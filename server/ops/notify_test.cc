#include "server/ops/notify.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

#include "core/base/files.h"

namespace color3d {
namespace {

TEST(NotifyTest, SendsOnlyToListeningSocket) {
  ::unsetenv("NOTIFY_SOCKET");
  EXPECT_FALSE(NotifyServiceManager("READY=1"));
  ScratchFolder scratch;
  const std::string path = (scratch.path() / "notify").string();
  ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  EXPECT_FALSE(NotifyServiceManager("READY=1")) << "no listening socket";
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
  ASSERT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  EXPECT_TRUE(NotifyServiceManager("READY=1"));
  char buffer[64] = {};
  EXPECT_EQ(::recv(fd, buffer, sizeof(buffer), 0), 7);
  EXPECT_STREQ(buffer, "READY=1");
  ::close(fd);
  ::unsetenv("NOTIFY_SOCKET");
}

}  // namespace
}  // namespace color3d
