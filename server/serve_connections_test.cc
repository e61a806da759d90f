// The real server with clients that open connections without using them: it still answers others,
// and reports and ends if it cannot.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <chrono>
#include <cstring>
#include <string_view>

#include "core/base/files.h"
#include "core/base/text/address.h"
#include "tests/support/service/server_process.h"

namespace color3d::testing {
namespace {
namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

// Time until a new client is answered, on a busy machine; a server that is held up takes longer
// than silent connections may stay open, 10 s.
constexpr milliseconds kServed(5'000);
constexpr int kIdle = 1'100;
constexpr rlim_t kFewDescriptors = 1'024;
// HTTP/2 client preface and empty settings.
constexpr std::string_view kPreface("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\4\0\0\0\0\0", 33);

// Connections that send this and then nothing.
class IdleConnections {
 public:
  IdleConnections(const std::string& server, int count, std::string_view words) {
    rlimit limit{};
    ::getrlimit(RLIMIT_NOFILE, &limit);
    limit.rlim_cur = limit.rlim_max;
    ::setrlimit(RLIMIT_NOFILE, &limit);
    sockaddr_storage address{};
    socklen_t size = sizeof(sockaddr_in);
    if (server.starts_with("unix:")) {
      auto& where = reinterpret_cast<sockaddr_un&>(address);
      where.sun_family = AF_UNIX;
      std::strncpy(where.sun_path, server.c_str() + 5, sizeof(where.sun_path) - 1);
      size = sizeof(where);
    } else {
      auto& where = reinterpret_cast<sockaddr_in&>(address);
      where.sin_family = AF_INET;
      where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      where.sin_port = htons(static_cast<uint16_t>(std::stoi(SplitHostPort(server).port)));
    }
    for (int i = 0; i < count; ++i) {
      const int fd = ::socket(address.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
      EXPECT_GE(fd, 0) << "this process needs more descriptors: ulimit -n";
      EXPECT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&address), size), 0)
          << std::strerror(errno);
      // Some are already closed.
      [[maybe_unused]] const ssize_t sent =
          ::send(fd, words.data(), words.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      sockets_.push_back(fd);
    }
  }
  ~IdleConnections() {
    for (const int fd : sockets_) ::close(fd);
  }
  IdleConnections(const IdleConnections&) = delete;
  IdleConnections& operator=(const IdleConnections&) = delete;

 private:
  std::vector<int> sockets_;
};

std::shared_ptr<grpc::Channel> OwnConnection(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

// Returns the time until a new client is answered.
milliseconds NewClientLatency(const std::string& address) {
  const auto start = steady_clock::now();
  TestClient client(OwnConnection(address));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
  v1::ServerInfo info;
  const grpc::Status status = client.server->GetServerInfo(&context, {}, &info);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return std::chrono::duration_cast<milliseconds>(steady_clock::now() - start);
}

class ConnectionsTest : public ::testing::Test {
 protected:
  void Attack(ServerProcess& server, std::string_view words) {
    {
      const IdleConnections idle(server.address(), kIdle, words);
      EXPECT_LT(NewClientLatency(server.address()), kServed) << "while they are open";
      SleepMs(1'000);
      EXPECT_LT(NewClientLatency(server.address()), kServed) << "while they are open";
    }
    EXPECT_LT(NewClientLatency(server.address()), kServed) << "when they are closed";
  }
  const ScratchFolder scratch_;
};

TEST_F(ConnectionsTest, ServesOthersBesideSilentOnes) {
  ServerProcess few(scratch_.path(), {}, 1, kFewDescriptors);
  Attack(few, "");
}

TEST_F(ConnectionsTest, ServesOthersBesideSilentOnesWithManyDescriptors) {
  ServerProcess server(scratch_.path(), {});
  Attack(server, "");
}

TEST_F(ConnectionsTest, ServesOthersBesideThoseThatSentOneByte) {
  ServerProcess few(scratch_.path(), {}, 1, kFewDescriptors);
  Attack(few, "P");
}

TEST_F(ConnectionsTest, ServesOthersBesideSilentOnesOnUnixSocket) {
  ServerProcess few(scratch_.path(),
                    {"--listen", "unix:" + (scratch_.path() / "s").string()},
                    1,
                    kFewDescriptors);
  Attack(few, "");
}

// These look like clients; the one with a call stays open.
TEST_F(ConnectionsTest, ServesOthersBesideHttpConnectionsWithoutCalls) {
  ServerProcess few(scratch_.path(), {}, 1, kFewDescriptors);
  TestClient watcher(OwnConnection(few.address()));
  const std::string job =
      watcher.Create(ScriptedSpec(watcher.MakeScene().name(), "steps=100,ms=50")).name();
  grpc::ClientContext context;
  v1::WatchJobsRequest request;
  request.add_names(job);
  const auto watch = watcher.jobs->WatchJobs(&context, request);
  v1::JobEvent event;
  ASSERT_TRUE(watch->Read(&event));
  Attack(few, kPreface);
  v1::Job::State last = v1::Job::STATE_UNSPECIFIED;
  while (watch->Read(&event)) {
    if (event.job().name() == job) last = event.job().state();
  }
  const grpc::Status status = watch->Finish();
  EXPECT_TRUE(status.ok()) << "the watch was cut: " << status.error_message();
  EXPECT_EQ(last, v1::Job::STATE_SUCCEEDED);
}

TEST_F(ConnectionsTest, UnreachableServerReportsAndEnds) {
  const fs::path socket = scratch_.path() / "s";
  ::testing::internal::CaptureStderr();
  ServerProcess server(scratch_.path(),
                       {"--listen", "unix:" + socket.string(), "--probe-seconds", "0.2"});
  SleepMs(1'000);
  EXPECT_LT(NewClientLatency(server.address()), kServed);
  ASSERT_TRUE(fs::remove(socket)) << "it did not survive its own looks";
  const int status = server.Wait();
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(status, 1) << "systemd starts it again; 2 would be for what a person must mend";
  EXPECT_THAT(said, ::testing::HasSubstr("unix:" + socket.string() + " no longer answered calls"));
}

TEST_F(ConnectionsTest, SecondServerDoesNotTakeOverSocket) {
  const std::string address = "unix:" + (scratch_.path() / "s").string();
  const fs::path other = scratch_.path() / "other";
  fs::create_directory(other);
  ServerProcess first(scratch_.path(), {"--listen", address});
  ::testing::internal::CaptureStderr();
  ServerProcess second(other, {"--listen", address}, 0);
  EXPECT_EQ(second.Wait(), 2);
  EXPECT_THAT(::testing::internal::GetCapturedStderr(),
              ::testing::HasSubstr("another server listens there"));
  EXPECT_LT(NewClientLatency(address), kServed);
  // A killed server leaves its socket, which the next one replaces.
  first.Signal(SIGKILL);
  first.Wait();
  ServerProcess third(other, {"--listen", address}, 0);
  EXPECT_LT(NewClientLatency(address), kServed);
}

}  // namespace
}  // namespace color3d::testing
