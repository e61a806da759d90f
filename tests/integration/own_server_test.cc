// A server of the user's own: the real programs, with the data folder of a new user.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <thread>

#include "core/base/files.h"
#include "tests/integration/service_fixture.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kNobody[] = "127.0.0.1:1";

class OwnServerTest : public ::testing::Test {
 protected:
  OwnServerTest() {
    ::setenv("XDG_DATA_HOME", home_.path().c_str(), 1);
    ::unsetenv("COLOR3D_SERVER");
  }
  ~OwnServerTest() override { EndServer(); }

  fs::path Data() const { return home_.path() / "color3d"; }
  std::string Socket() const { return "unix:" + (Data() / "server.sock").string(); }
  ProcessResult Color3d(const std::vector<std::string>& arguments) {
    const ScratchFolder log(home_.path());
    return RunProcess(
        std::vector<std::string>{ClientProgram()} + arguments, log.path(), seconds(60));
  }
  // Arguments of `color3d-server serve` as commands start it.
  std::vector<std::string> Serve(const std::string& idle_exit) const {
    return {ServerProgram(),
            "serve",
            "--data-dir",
            Data(),
            "--listen",
            Socket(),
            "--idle-exit",
            idle_exit};
  }
  void EndServer() { Color3d({"--server", Socket(), "server", "drain"}); }
  int Starts() const {
    std::string log = ReadFile(Data() / "server.log");
    int count = 0;
    for (size_t at = 0; (at = log.find("listening on", at)) != log.npos; ++at) ++count;
    return count;
  }

  const ScratchFolder home_;
};

TEST_F(OwnServerTest, TwoCommandsAtOnceStartOneServer) {
  std::vector<ProcessResult> results(2);
  std::vector<std::thread> commands;
  for (ProcessResult& result : results) {
    commands.emplace_back([this, &result] { result = Color3d({"job", "list"}); });
  }
  for (std::thread& command : commands) command.join();
  for (const ProcessResult& result : results) EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(results[0].err + results[1].err, HasSubstr("starting a server of your own"));
  EXPECT_EQ(Starts(), 1);
  // It outlives them, and the next command says nothing.
  const ProcessResult next = Color3d({"server", "info"});
  EXPECT_EQ(next.exit_code, 0) << next.err;
  EXPECT_THAT(next.err, Not(HasSubstr("starting")));
  EXPECT_EQ(Starts(), 1);
}

TEST_F(OwnServerTest, EndsWhenIdle) {
  Process server(Serve("1s"), home_.path() / "log");
  EXPECT_EQ(server.Wait(seconds(30)), 0) << server.Err();
  EXPECT_THAT(server.Err() + server.Out(), HasSubstr("nobody has used this server for 1 s"));
}

TEST_F(OwnServerTest, WaitsForAnEndingServer) {
  {
    // Holds the data folder at another address, and ends while the command waits.
    Process other({ServerProgram(),
                   "serve",
                   "--data-dir",
                   Data(),
                   "--listen",
                   "127.0.0.1:0",
                   "--idle-exit",
                   "3s"},
                  home_.path() / "log");
    ASSERT_TRUE(WaitUntil([&] { return fs::exists(Data() / "jobs.db"); }, seconds(30)));
    const ProcessResult result = Color3d({"job", "list"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(other.Wait(seconds(1)), 0);
  }
}

TEST_F(OwnServerTest, NamedServerIsNotReplaced) {
  const ProcessResult flag = Color3d({"--server", kNobody, "job", "list"});
  EXPECT_EQ(flag.exit_code, 3) << flag.err;
  EXPECT_THAT(flag.err, HasSubstr("cannot reach a server"));
  ::setenv("COLOR3D_SERVER", kNobody, 1);
  EXPECT_EQ(Color3d({"job", "list"}).exit_code, 3);
  ::unsetenv("COLOR3D_SERVER");
  EXPECT_FALSE(fs::exists(Data() / "server.sock"));
}

TEST_F(OwnServerTest, CommandsOfTheOperatorStartNone) {
  const ProcessResult result = Color3d({"server", "info"});
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_FALSE(fs::exists(Data() / "server.sock"));
}

}  // namespace
}  // namespace color3d
