#include "core/base/process/sandbox.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <functional>
#include <thread>
#include <vector>

#include "core/base/files.h"
#include "core/base/memory.h"
#include "core/base/process/landlock.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

// Runs `attempt` in a sandboxed process. Returns its errno, 0 for success, or 255 if the process
// ended otherwise.
int InSandbox(const SandboxRules& rules, const std::function<bool()>& attempt) {
  const Sandbox sandbox(rules);
  const pid_t child = ::fork();
  if (child == 0) {
    if (!sandbox.Enter()) ::_exit(254);
    errno = 0;
    ::_exit(attempt() ? 0 : errno);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 255;
}

bool CanOpen(const fs::path& path, int flags) {
  const int fd = ::open(path.c_str(), flags | O_CLOEXEC, 0600);
  if (fd >= 0) ::close(fd);
  return fd >= 0;
}

bool CanMakeSocket(int family) { return ::socket(family, SOCK_STREAM, 0) >= 0; }

// Connects to a listening port of this process.
bool CanConnect(uint16_t port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = port;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return ::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
}

bool CanFork() {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(0);
  if (child > 0) ::waitpid(child, nullptr, 0);
  return child > 0;
}

class SandboxTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!Sandbox(SandboxRules()).missing().empty()) GTEST_SKIP() << "not on this machine";
    rules_.writable = {scratch_.path() / "own"};
    fs::create_directories(scratch_.path() / "own");
    std::ofstream(scratch_.path() / "secret") << "42";
    std::ofstream(scratch_.path() / "given") << "42";
  }
  ScratchFolder scratch_;
  SandboxRules rules_;
};

// The worker's peak memory of a job must not include that of the jobs before it.
TEST_F(SandboxTest, AllowsResetOfPeakMemory) {
  const Sandbox sandbox(rules_);
  const pid_t child = ::fork();
  if (child == 0) {
    ResetPeakMemory();
    if (!sandbox.Enter()) ::_exit(254);
    constexpr size_t kBytes = size_t{64} << 20;
    {
      const std::vector<char> used(kBytes, 'x');
      [[maybe_unused]] const volatile char last =
          used.back();  // keeps the compiler from leaving it out
    }
    const bool has_risen = PeakMemoryBytes() > ResidentMemoryBytes() + int64_t{kBytes / 2};
    ResetPeakMemory();
    const bool has_fallen = PeakMemoryBytes() < ResidentMemoryBytes() + int64_t{kBytes / 2};
    ::_exit(has_risen && has_fallen ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(SandboxTest, DeniesFilesOutsideRules) {
  const fs::path own = scratch_.path() / "own";
  EXPECT_EQ(InSandbox(rules_, [&] { return CanOpen(own / "new", O_WRONLY | O_CREAT); }), 0);
  EXPECT_EQ(InSandbox(rules_, [&] { return CanOpen(own / "new", O_RDONLY); }), 0);
  EXPECT_EQ(InSandbox(rules_, [] { return CanOpen("/dev/null", O_RDWR); }), 0);
  EXPECT_EQ(InSandbox(rules_, [] { return CanOpen("/usr/bin/env", O_RDONLY); }), 0);
  EXPECT_EQ(InSandbox(rules_, [&] { return CanOpen(scratch_.path() / "secret", O_RDONLY); }),
            EACCES);
  EXPECT_EQ(InSandbox(rules_, [&] { return CanOpen(scratch_.path() / "secret", O_WRONLY); }),
            EACCES);
  EXPECT_EQ(InSandbox(rules_, [&] { return CanOpen(scratch_.path() / "n", O_WRONLY | O_CREAT); }),
            EACCES);
  EXPECT_EQ(
      InSandbox(
          rules_,
          [&] { return ::rename((own / "new").c_str(), (scratch_.path() / "out").c_str()) == 0; }),
      EACCES);
  EXPECT_EQ(InSandbox(rules_, [&] { return ::unlink((scratch_.path() / "secret").c_str()) == 0; }),
            EACCES);
  // A symbolic link does not bypass the rules.
  fs::create_symlink(scratch_.path() / "secret", own / "link");
  EXPECT_EQ(InSandbox(rules_, [&] { return CanOpen(own / "link", O_RDONLY); }), EACCES);

  rules_.readable = {scratch_.path() / "given", scratch_.path() / "not there"};
  EXPECT_EQ(InSandbox(rules_, [&] { return CanOpen(scratch_.path() / "given", O_RDONLY); }), 0);
  EXPECT_EQ(InSandbox(rules_, [&] { return CanOpen(scratch_.path() / "given", O_WRONLY); }),
            EACCES);
}

TEST_F(SandboxTest, DoesNotRunProgramsCreatedInside) {
  const fs::path program = scratch_.path() / "own" / "program";
  fs::copy_file("/bin/true", program);
  EXPECT_EQ(InSandbox(rules_, [&] { return ::execl(program.c_str(), "true", nullptr) == 0; }),
            EACCES);
  EXPECT_EQ(InSandbox(rules_, [] { return ::execl("/bin/true", "true", nullptr) == 0; }), 0);
}

TEST_F(SandboxTest, FollowsSocketRules) {
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  ASSERT_EQ(::bind(listener, reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(::listen(listener, 4), 0);
  ASSERT_EQ(::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size), 0);
  ASSERT_TRUE(CanConnect(address.sin_port));

  EXPECT_EQ(InSandbox(rules_, [] { return CanMakeSocket(AF_UNIX); }), EPERM);
  EXPECT_EQ(InSandbox(rules_, [] { return CanMakeSocket(AF_INET); }), EPERM);
  // The kernel reads only the lower half of the number.
  const auto with_high_bits = [] {
    return ::syscall(SYS_socket, (1L << 32) | AF_INET, SOCK_STREAM, 0) >= 0;
  };
  EXPECT_EQ(InSandbox(rules_, with_high_bits), EPERM);
  rules_.sockets = Sockets::kLocal;
  EXPECT_EQ(InSandbox(rules_, [] { return CanMakeSocket(AF_UNIX); }), 0);
  EXPECT_EQ(InSandbox(rules_, [] { return CanMakeSocket(AF_INET6); }), EPERM);
  EXPECT_EQ(InSandbox(rules_, with_high_bits), EPERM);
  rules_.sockets = Sockets::kAll;
  EXPECT_EQ(InSandbox(rules_, [&] { return CanConnect(address.sin_port); }), 0);
  EXPECT_EQ(InSandbox(rules_, [] { return CanMakeSocket(AF_PACKET); }), EPERM);
  ::close(listener);
}

TEST_F(SandboxTest, DeniesOtherProcessesAndKernel) {
  rules_.may_start_processes = true;
  EXPECT_EQ(InSandbox(rules_, [] { return ::ptrace(PTRACE_TRACEME, 0, 0, 0) == 0; }), EPERM);
  EXPECT_EQ(InSandbox(rules_, [] { return ::mount("none", "/mnt", "tmpfs", 0, "") == 0; }), EPERM);
  EXPECT_EQ(InSandbox(rules_, [] { return ::unshare(CLONE_NEWUSER) == 0; }), EPERM);
  const auto namespaced = [] {
    const long child = ::syscall(SYS_clone, CLONE_NEWUSER | SIGCHLD, 0, 0, 0, 0);
    if (child == 0) ::_exit(0);
    return child > 0;
  };
  EXPECT_EQ(InSandbox(rules_, namespaced), EPERM);
  EXPECT_EQ(InSandbox(rules_, [] { return ::syscall(SYS_clone3, nullptr, 0) >= 0; }), ENOSYS);
  EXPECT_EQ(InSandbox(rules_, [] { return ::syscall(SYS_bpf, 0, 0, 0) >= 0; }), EPERM);
  EXPECT_EQ(InSandbox(rules_, [] { return ::syscall(SYS_io_uring_setup, 1, 0) >= 0; }), EPERM);
  EXPECT_EQ(InSandbox(rules_, [] { return ::ioctl(0, TIOCSTI, "x") == 0; }), EPERM);
  if (LandlockAbi() >= 6) {
    const pid_t outside = ::getpid();
    EXPECT_EQ(InSandbox(rules_, [outside] { return ::kill(outside, 0) == 0; }), EPERM);
  }
  EXPECT_EQ(InSandbox(rules_, [] { return CanFork(); }), 0);
}

TEST_F(SandboxTest, AllowsThreadsButNoProcesses) {
  EXPECT_EQ(InSandbox(rules_, [] { return CanFork(); }), EPERM);
  const auto with_a_thread = [] {
    int answer = 0;
    std::thread([&answer] { answer = 42; }).join();
    return answer == 42;
  };
  EXPECT_EQ(InSandbox(rules_, with_a_thread), 0);
}

TEST_F(SandboxTest, NestedSandboxIntersectsRights) {
  SandboxRules inner;
  inner.writable = {scratch_.path()};
  const Sandbox outer(rules_);
  const pid_t child = ::fork();
  if (child == 0) {
    if (!outer.Enter()) ::_exit(254);
    ::_exit(Sandbox(inner).Enter() && !CanOpen(scratch_.path() / "secret", O_RDONLY) ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace color3d
