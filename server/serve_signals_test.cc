// The real server and its workers as processes: signals, inherited environment, and orphaned
// processes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>

#include <functional>

#include "core/base/files.h"
#include "server/ops/process_state.h"
#include "tests/support/service/processes.h"
#include "tests/support/service/server_process.h"
#include "tests/support/service/test_certificates.h"

namespace color3d::testing {
namespace {
namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::Not;

class SignalsTest : public ::testing::Test {
 protected:
  // Starts a job of this number of steps of 50 ms.
  static std::string Begin(TestClient& client, int steps) {
    const std::string job =
        client
            .Create(ScriptedSpec(client.MakeScene().name(), "ms=50,steps=" + std::to_string(steps)))
            .name();
    EXPECT_TRUE(WaitUntil([&] { return client.Get(job).progress().step() >= 2; }, seconds(20)));
    return job;
  }
  const ScratchFolder scratch_;
};

// Ctrl-\\, shutdown of a container, limit of CPU time: all drain.
TEST_F(SignalsTest, DrainsOnEverySignalToEnd) {
  for (const int signal : {SIGQUIT, SIGPWR, SIGXCPU}) {
    SCOPED_TRACE(::strsignal(signal));
    const fs::path folder = scratch_.path() / std::to_string(signal);
    fs::create_directory(folder);
    std::string job;
    {
      ServerProcess server(folder, {});
      job = Begin(server.client(), 30);
      server.Signal(signal);
      EXPECT_EQ(server.Wait(), 0);
    }
    ServerProcess next(folder, {});
    const v1::Job done = next.client().WaitFinished(job);
    EXPECT_EQ(done.state(), v1::Job::STATE_SUCCEEDED);
    EXPECT_EQ(done.attempt(), 1) << "the attempt was counted as lost";
  }
}

TEST_F(SignalsTest, IgnoresSignalsMeantForOthers) {
  ServerProcess server(scratch_.path(), {});
  const std::string job = Begin(server.client(), 10);
  const pid_t worker = server.Workers().at(0);
  for (const int signal : {SIGHUP, SIGUSR1, SIGUSR2, SIGALRM, SIGIO, SIGPIPE, SIGPROF, SIGVTALRM}) {
    SCOPED_TRACE(::strsignal(signal));
    server.Signal(signal);
    if (signal != SIGHUP) ::kill(worker, signal);
  }
  EXPECT_EQ(server.client().WaitFinished(job).state(), v1::Job::STATE_SUCCEEDED);
  EXPECT_EQ(server.client().Get(job).attempt(), 1);
  EXPECT_FALSE(server.HasEnded());
}

TEST_F(SignalsTest, WorkerSavesAndRestartsOnHangUp) {
  ServerProcess server(scratch_.path(), {});
  const std::string job = Begin(server.client(), 60);
  for (const int signal : {SIGHUP, SIGQUIT}) {
    SCOPED_TRACE(::strsignal(signal));
    const std::vector<pid_t> workers = server.Workers();
    ASSERT_FALSE(workers.empty());
    ::kill(workers.at(0), signal);
    EXPECT_TRUE(WaitUntil(
        [&] {
          const std::vector<pid_t> now = server.Workers();
          return !now.empty() && now.at(0) != workers.at(0);
        },
        seconds(20)));
  }
  EXPECT_EQ(server.client().WaitFinished(job).state(), v1::Job::STATE_SUCCEEDED);
  EXPECT_EQ(server.client().Get(job).attempt(), 1) << "the attempt was counted as lost";
}

// Workers decode untrusted files.
TEST_F(SignalsTest, WorkersInheritNoSecrets) {
  for (const char* name : {"COLOR3D_TOKEN", "AWS_SECRET_ACCESS_KEY", "DATABASE_URL"}) {
    ::setenv(name, "top-secret", 1);
  }
  ServerProcess server(scratch_.path(), {});
  for (const char* name : {"COLOR3D_TOKEN", "AWS_SECRET_ACCESS_KEY", "DATABASE_URL"}) {
    ::unsetenv(name);
  }
  ASSERT_TRUE(WaitUntil([&] { return !server.Workers().empty(); }, seconds(20)));
  const auto environment = [](pid_t pid) {
    std::ifstream stream("/proc/" + std::to_string(pid) + "/environ");
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  EXPECT_THAT(environment(server.pid()), HasSubstr("top-secret")) << "the test proves nothing";
  const std::string seen = environment(server.Workers().at(0));
  EXPECT_THAT(seen, HasSubstr("PATH="));
  EXPECT_THAT(seen, Not(HasSubstr("top-secret")));
}

// Signals to a frozen worker wait until it is resumed.
TEST_F(SignalsTest, NextServerEndsFrozenWorkerOfKilledOne) {
  pid_t frozen = 0;
  std::string job;
  {
    ServerProcess server(scratch_.path(), {});
    job = Begin(server.client(), 40);
    frozen = server.Workers().at(0);
    ::kill(frozen, SIGSTOP);
    server.Signal(SIGKILL);
    server.Wait();
  }
  ASSERT_TRUE(IsRunning(frozen));
  ServerProcess next(scratch_.path(), {});
  EXPECT_TRUE(WaitUntil([&] { return !IsRunning(frozen); }, seconds(10)));
  EXPECT_EQ(next.client().WaitFinished(job).state(), v1::Job::STATE_SUCCEEDED);
}

// Living processes and zombies.
int ProcessesNamed(const std::string& name) {
  int count = 0;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator("/proc", error)) {
    std::ifstream stream(entry.path() / "comm");
    std::string said;
    count += std::getline(stream, said) && said == name ? 1 : 0;
  }
  return count;
}

// As the first process of a container, the server inherits orphaned processes.
TEST_F(SignalsTest, ReapsOrphansAsFirstProcess) {
  const std::string name = "nap" + std::to_string(::getpid());
  const fs::path nap = scratch_.path() / name;
  fs::copy_file("/bin/sleep", nap);
  const std::string inner = "'" + nap.string() +
                            "' 2 & exec " COLOR3D_SERVER
                            " serve --listen 127.0.0.1:0 --workers 0 --data-dir '" +
                            (scratch_.path() / "data").string() + "' --port-file '" +
                            (scratch_.path() / "port").string() + "'";
  Process container({"unshare",
                     "--user",
                     "--map-root-user",
                     "--pid",
                     "--fork",
                     "--kill-child",
                     "sh",
                     "-c",
                     inner},
                    scratch_.path());
  WaitUntil([&] { return fs::exists(scratch_.path() / "port") || !container.IsRunning(); },
            seconds(20));
  if (!container.IsRunning()) {
    GTEST_SKIP() << "this machine makes no namespace of processes: " << container.Err();
  }
  EXPECT_TRUE(WaitUntil([&] { return ProcessesNamed(name) == 0; }, seconds(20)))
      << "nobody waited for it";
}

TEST_F(SignalsTest, RefusesClientCaWithoutRolesAtStart) {
  TestAuthority ours(scratch_.path(), "ours");
  const CertificateFiles own = ours.Issue("server");
  const std::vector<std::string> tls = {
      "--tls-cert", own.certificate, "--tls-key", own.key, "--tls-client-ca", ours.certificate()};
  ::testing::internal::CaptureStderr();
  ServerProcess refused(scratch_.path(), tls, 0);
  EXPECT_EQ(refused.Wait(), 2);
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), HasSubstr("--certificate-roles"));
  WriteFileAtomic(scratch_.path() / "roles", "* read\n");
  std::vector<std::string> with_roles = tls;
  with_roles.insert(with_roles.end(), {"--certificate-roles", scratch_.path() / "roles"});
  ServerProcess allowed(scratch_.path(), with_roles, 0);
  EXPECT_FALSE(allowed.HasEnded());
}

}  // namespace
}  // namespace color3d::testing
