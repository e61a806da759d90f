// One `color3d-server serve` with scripted workers, for the process tests, on the kind of job store
// of test_store.h. Dies with the test.
#pragma once

#include <grpcpp/grpcpp.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/service/rpc_support.h"
#include "tests/support/service/test_store.h"

namespace color3d::testing {

inline void SleepMs(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

// One `color3d-server serve` on a data folder.
class ServerProcess {
 public:
  // `max_descriptors`: limit of open descriptors; 0: that of this process.
  ServerProcess(const std::filesystem::path& folder,
                std::vector<std::string> extra,
                int workers = 1,
                rlim_t max_descriptors = 0,
                const std::string& program = COLOR3D_SERVER) {
    const std::filesystem::path port_file = folder / "port";
    std::filesystem::remove(port_file);
    std::vector<std::string> arguments = {program,
                                          "serve",
                                          "--port-file",
                                          port_file,
                                          "--data-dir",
                                          folder / "data",
                                          "--workers",
                                          std::to_string(workers)};
    // Default flags.
    const std::vector<std::pair<const char*, const char*>> defaults = {
        {"--listen", "127.0.0.1:0"},
        {"--worker-program", COLOR3D_TEST_WORKER},
        {"--threads", "1"},
        {"--lease-seconds", "1"},
        {"--heartbeat-seconds", "0.2"},
        {"--checkpoint-seconds", "0"},
        {"--retry-backoff-ms", "50"},
        {"--worker-backoff-ms", "100"},
        {"--reserve-mib", "0"},
        {"--low-space-mib", "0"},
        {"--log-level", "warn"}};
    for (const auto& [flag, value] : defaults) {
      if (std::find(extra.begin(), extra.end(), flag) == extra.end()) {
        arguments.insert(arguments.end(), {flag, value});
      }
    }
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    const std::string store = TestStoreAddress(folder / "data");
    if (!store.empty()) arguments.insert(arguments.end(), {"--store", store});
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    pid_ = ::fork();
    if (pid_ == 0) {
      const rlimit limit{max_descriptors, max_descriptors};
      if (max_descriptors > 0) ::setrlimit(RLIMIT_NOFILE, &limit);
      ::execv(program.c_str(), argv.data());
      ::_exit(127);
    }
    for (int i = 0; i < 400 && !std::filesystem::exists(port_file) && !HasEnded(); ++i) SleepMs(25);
    std::ifstream(port_file) >> address_;
    client_ = std::make_unique<TestClient>(address_);
  }
  ~ServerProcess() {
    if (pid_ != 0) Signal(SIGKILL), Wait();
  }
  TestClient& client() { return *client_; }
  const std::string& address() const { return address_; }
  pid_t pid() const { return pid_; }
  void Signal(int signal) { ::kill(pid_, signal); }
  bool HasEnded() const {
    siginfo_t ended{};
    return ::waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           ended.si_pid == pid_;
  }
  // Returns the exit status, or 128 + signal.
  int Wait() {
    int status = 0;
    ::waitpid(pid_, &status, 0);
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  v1::ServerInfo Info() {
    v1::ServerInfo info;
    grpc::ClientContext context;
    client_->server->GetServerInfo(&context, {}, &info);
    return info;
  }
  // Process ids of the workers for jobs; or of the inference worker, if it runs.
  std::vector<pid_t> Workers(bool inference = false) {
    std::vector<pid_t> pids;
    const v1::ServerInfo info = Info();
    for (const v1::WorkerInfo& worker : info.workers()) {
      if (worker.worker_id().starts_with("inference-") != inference) continue;
      pids.push_back(static_cast<pid_t>(worker.pid()));
    }
    return pids;
  }

 private:
  pid_t pid_ = 0;
  std::string address_;
  std::unique_ptr<TestClient> client_;
};

}  // namespace color3d::testing
