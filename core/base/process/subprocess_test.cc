#include "core/base/process/subprocess.h"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <string>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {

TEST(Subprocess, ReportsExitCodeLogTimeoutAndCancellation) {
  ScratchFolder scratch;
  CancellationToken cancel;
  SubprocessOptions options;
  options.arguments = {"sh", "-c", "echo $COLOR3D_TEST; exit 3"};
  options.environment = {"COLOR3D_TEST=hello"};
  options.log_path = scratch.path() / "log";
  EXPECT_EQ(RunSubprocess(options, cancel).exit_code, 3);
  EXPECT_EQ(ReadFile(options.log_path), "hello\n");

  options.arguments = {"sh", "-c", "sleep 60 & wait"};
  options.timeout = std::chrono::seconds(0);
  EXPECT_TRUE(RunSubprocess(options, cancel).timed_out);

  options.timeout = std::chrono::seconds(60);
  cancel.Cancel();
  EXPECT_THROW(RunSubprocess(options, cancel), Error);

  options.arguments = {"color3d-no-such-program"};
  CancellationToken fresh;
  try {
    RunSubprocess(options, fresh);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailedPrecondition);
  }
}

// As from a server, which handles its signals itself.
TEST(Subprocess, RestoresSignalsOfTheProgram) {
  ScratchFolder scratch;
  sigset_t blocked, before;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGTERM);
  ASSERT_EQ(pthread_sigmask(SIG_BLOCK, &blocked, &before), 0);
  const auto old = std::signal(SIGUSR1, SIG_IGN);
  SubprocessOptions options;
  options.arguments = {"grep", "-E", "^Sig(Blk|Ign)", "/proc/self/status"};
  options.log_path = scratch.path() / "log";
  EXPECT_EQ(RunSubprocess(options, CancellationToken()).exit_code, 0);
  std::signal(SIGUSR1, old);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  EXPECT_EQ(ReadFile(options.log_path), "SigBlk:\t0000000000000000\nSigIgn:\t0000000000000000\n");
}

// Runs a shell script under these limits.
SubprocessResult RunShell(const std::string& script,
                          const ProcessLimits& limits,
                          const std::filesystem::path& log) {
  SubprocessOptions options;
  options.arguments = {"sh", "-c", script};
  options.log_path = log;
  options.timeout = std::chrono::seconds(60);
  options.limits = limits;
  return RunSubprocess(options, CancellationToken());
}

TEST(Subprocess, LimitsEndRunawayProcesses) {
  ScratchFolder scratch;
  const std::filesystem::path log = scratch.path() / "log", big = scratch.path() / "big";
  ProcessLimits limits;
  limits.file_bytes = 1 << 20;
  const SubprocessResult writer =
      RunShell("exec cat /dev/zero > '" + big.string() + "'", limits, log);
  EXPECT_EQ(writer.signal, SIGXFSZ);
  EXPECT_EQ(std::filesystem::file_size(big), 1u << 20);
  EXPECT_EQ(LikelyCause(writer.signal, limits), "it wrote a file of more than 1 MiB");

  limits = {};
  limits.memory_bytes = 64 << 20;
  const SubprocessResult eater = RunShell("exec tail /dev/zero", limits, log);  // one endless line
  EXPECT_NE(eater.exit_code, 0);
  EXPECT_FALSE(eater.timed_out);
  EXPECT_NE(ReadFile(log).find("memory exhausted"), std::string::npos) << ReadFile(log);

  limits = {};
  limits.cpu_seconds = 1;
  const SubprocessResult spinner = RunShell("while :; do :; done", limits, log);
  EXPECT_TRUE(spinner.signal == SIGXCPU || spinner.signal == SIGKILL) << spinner.signal;
  EXPECT_LT(spinner.seconds, 30.0);

  limits = {};
  limits.descriptors = 64;
  EXPECT_EQ(RunShell("test $(ulimit -n) = 64 && test $(ulimit -c) = 0", limits, log).exit_code, 0);
}

TEST(Subprocess, SandboxStopsForkBomb) {
  if (!Sandbox(SandboxRules()).missing().empty()) GTEST_SKIP() << "not on this machine";
  ScratchFolder scratch;
  SubprocessOptions options;
  options.arguments = {"sh", "-c", "bomb() { bomb | bomb; }; bomb"};
  options.log_path = scratch.path() / "log";
  options.sandbox = SandboxRules();
  options.timeout = std::chrono::seconds(30);
  const SubprocessResult result = RunSubprocess(options, CancellationToken());
  EXPECT_NE(result.exit_code, 0);
  EXPECT_FALSE(result.timed_out);
  EXPECT_NE(ReadFile(options.log_path).find("Cannot fork"), std::string::npos);
}

TEST(Subprocess, SandboxedProgramReachesOwnFolderOnly) {
  if (!Sandbox(SandboxRules()).missing().empty()) GTEST_SKIP() << "not on this machine";
  ScratchFolder scratch, other;
  SubprocessOptions options;
  options.arguments = {"sh",
                       "-c",
                       "echo in > '" + (scratch.path() / "in").string() + "' && echo out > '" +
                           (other.path() / "out").string() + "'"};
  options.sandbox = SandboxRules();
  options.sandbox->writable = {scratch.path()};
  options.log_path = other.path() / "log";  // opened by the parent
  EXPECT_NE(RunSubprocess(options, CancellationToken()).exit_code, 0);
  EXPECT_EQ(ReadFile(scratch.path() / "in"), "in\n");
  EXPECT_FALSE(std::filesystem::exists(other.path() / "out"));
  EXPECT_NE(ReadFile(options.log_path).find("Permission denied"), std::string::npos);
}

TEST(Subprocess, DoesNotPassTokens) {
  ScratchFolder scratch;
  ::setenv("COLOR3D_TOKEN", "secret", 1);
  SubprocessOptions options;
  options.arguments = {"env"};
  options.environment = {"GIVEN=yes"};
  options.log_path = scratch.path() / "log";
  EXPECT_EQ(RunSubprocess(options, CancellationToken()).exit_code, 0);
  ::unsetenv("COLOR3D_TOKEN");
  const std::string seen = ReadFile(options.log_path);
  EXPECT_EQ(seen.find("COLOR3D_TOKEN"), std::string::npos) << seen;
  EXPECT_NE(seen.find("GIVEN=yes"), std::string::npos) << seen;
  EXPECT_NE(seen.find("PATH="), std::string::npos) << seen;
}

}  // namespace
}  // namespace color3d
