// Server, workers and client for tests: real processes on a free port, in a temporary folder. The
// fixture removes everything at its end.
#pragma once

#include <grpcpp/channel.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "color3d/v1/job.grpc.pb.h"
#include "color3d/v1/scene.grpc.pb.h"
#include "color3d/v1/server.grpc.pb.h"
#include "core/base/files.h"
#include "tests/support/scenes/procedural_scene.h"
#include "tests/support/service/processes.h"

namespace color3d {

// Absolute paths of the programs under test.
std::string ServerProgram();
std::string ClientProgram();

// `color3d-server serve` with one worker of two threads. The constructor returns when the server
// listens, or throws Error{kUnavailable} with its log.
class TestServer {
 public:
  explicit TestServer(const std::filesystem::path& folder,
                      const std::vector<std::string>& more_flags = {},
                      const std::string& listen = "127.0.0.1:0");
  ~TestServer();

  const std::string& address() const { return address_; }
  std::shared_ptr<grpc::Channel> channel() const { return channel_; }
  pid_t pid() const { return process_.pid(); }
  std::string Log() const { return process_.Err() + process_.Out(); }
  bool IsRunning() { return process_.IsRunning(); }
  // Returns true if the server answers within ten seconds.
  bool IsHealthy();
  v1::ServerInfo Info() const;
  std::vector<v1::Job> ListJobs() const;
  // Sends SIGTERM. Returns the exit code, or -1 if the server had to be killed.
  int Stop();

 private:
  static std::vector<std::string> Arguments(const std::filesystem::path& folder,
                                            const std::vector<std::string>& more_flags,
                                            const std::string& listen);

  Process process_;
  std::string address_;
  std::shared_ptr<grpc::Channel> channel_;
};

class ServiceTest : public testing::Test {
 protected:
  // Prints the server's log if the test failed.
  void TearDown() override;

  // The next server uses the same data folder.
  void StartServer(const std::vector<std::string>& flags = {},
                   const std::string& listen = "127.0.0.1:0");
  void StopServer() { server_.reset(); }
  TestServer& server() { return *server_; }
  std::filesystem::path Path(const std::string& name) const { return folder_.path() / name; }

  // Runs `color3d ARGUMENTS` against the server.
  ProcessResult Client(const std::vector<std::string>& arguments,
                       std::chrono::seconds limit = std::chrono::seconds(400)) const;
  std::vector<std::string> ClientCommand(const std::vector<std::string>& arguments) const;
  // Returns the newest job of this kind; fails the test if there is none.
  v1::Job NewestJob(const std::string& kind) const;
  // Creates a job, waits for its end and returns its name. Fails the test unless the job succeeds.
  std::string RunJob(const v1::JobSpec& spec) const;

  // Expects a refusal: this exit code, and as the last line on stderr one message with all `words`.
  // The server must continue.
  void ExpectRefusal(const ProcessResult& result,
                     int exit_code,
                     const std::vector<std::string>& words);

  const ScratchFolder folder_;

 private:
  std::unique_ptr<TestServer> server_;
};

// Writes a small room. `gray`: monochrome photos, with the colour ones in truth/.
ProceduralSceneOptions SmallRoom(int views = 10, bool gray = false);

// Flags of a server that detects dead workers within seconds and writes checkpoints often.
std::vector<std::string> QuickRecovery();

// Options for the quickest `color3d colorize`.
std::vector<std::string> QuickOptions();

// Concatenation.
std::vector<std::string> operator+(std::vector<std::string> left,
                                   const std::vector<std::string>& right);

}  // namespace color3d
