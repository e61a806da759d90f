#include "client/lib/local_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <thread>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d::client {
namespace {
namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class LocalServerTest : public ::testing::Test {
 protected:
  // A script in place of the server: what it does is in `lines`.
  void WriteProgram(const std::string& lines) {
    options_.program = scratch_.path() / "color3d-server";
    std::ofstream(options_.program) << "#!/bin/sh\n" << lines << "\n";
    ::chmod(options_.program.c_str(), 0755);
  }
  // Returns the message of the error, with its code before it.
  std::string Refusal() {
    try {
      return "found " + FindOrStartServer(options_, say_, cancel_);
    } catch (const Error& e) {
      return std::string(ErrorCodeName(e.code())) + " " + e.what();
    }
  }
  // Accepts connections at the address of the user's own server until the test ends.
  int ListenHere() {
    fs::create_directories(options_.data_folder);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string path = options_.data_folder / "server.sock";
    std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
    const int listener = ::socket(AF_UNIX, SOCK_STREAM, 0);
    ::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
    ::listen(listener, 10);
    return listener;
  }

  const ScratchFolder scratch_;
  const CancellationToken cancel_;
  std::vector<std::string> said_;
  const std::function<void(const std::string&)> say_ = [this](const std::string& line) {
    said_.push_back(line);
  };
  LocalServerOptions options_{.program = scratch_.path() / "color3d-server",
                              .data_folder = scratch_.path() / "data",
                              .start_patience = seconds(20)};
};

TEST_F(LocalServerTest, DataFolderFollowsXdg) {
  ::setenv("XDG_DATA_HOME", "/data/home", 1);
  EXPECT_EQ(UserDataFolder(), "/data/home/color3d");
  ::setenv("XDG_DATA_HOME", "relative", 1);  // to be ignored, says the specification
  ::setenv("HOME", "/home/ada", 1);
  EXPECT_EQ(UserDataFolder(), "/home/ada/.local/share/color3d");
  ::unsetenv("XDG_DATA_HOME");
  EXPECT_EQ(UserDataFolder(), "/home/ada/.local/share/color3d");
  ::unsetenv("HOME");
  EXPECT_EQ(UserDataFolder(), "");
  options_.data_folder = "";
  EXPECT_THAT(Refusal(), HasSubstr("FAILED_PRECONDITION no server runs, and there is no home"));
}

TEST_F(LocalServerTest, AddressIsSocketInDataFolder) {
  EXPECT_EQ(LocalServerAddress("/data/color3d"), "unix:/data/color3d/server.sock");
  EXPECT_EQ(ServerProgram().filename(), "color3d-server");
  EXPECT_TRUE(fs::exists(ServerProgram().parent_path()));
}

TEST_F(LocalServerTest, TakesOneThatRuns) {
  const std::string address = LocalServerAddress(options_.data_folder);
  EXPECT_FALSE(AcceptsConnections(address));
  const int listener = ListenHere();
  EXPECT_TRUE(AcceptsConnections(address));
  EXPECT_EQ(FindServer(options_.data_folder), address);
  EXPECT_EQ(FindOrStartServer(options_, say_, cancel_), address);
  EXPECT_THAT(said_, IsEmpty());
  ::close(listener);
  EXPECT_FALSE(AcceptsConnections(address)) << "the file of the socket is still there";
}

TEST_F(LocalServerTest, MissingProgramNamesRemedy) {
  EXPECT_THAT(Refusal(),
              testing::AllOf(HasSubstr("FAILED_PRECONDITION no server runs"),
                             HasSubstr(options_.program.string() + " is missing"),
                             HasSubstr("--server")));
}

TEST_F(LocalServerTest, ReportsLastLineOfLog) {
  WriteProgram("echo first; echo 'the disk is full' >&2; exit 2");
  EXPECT_THAT(Refusal(),
              testing::AllOf(HasSubstr("UNAVAILABLE the server of your own did not start: the disk "
                                       "is full"),
                             HasSubstr((options_.data_folder / "server.log").string())));
  EXPECT_THAT(said_, SizeIs(1));
  struct stat status {};
  ::stat(options_.data_folder.c_str(), &status);
  EXPECT_EQ(status.st_mode & 0777, 0700u);
}

TEST_F(LocalServerTest, UnwritableDataFolderNamesRemedy) {
  std::ofstream(scratch_.path() / "file") << "no folder";
  options_.data_folder = scratch_.path() / "file" / "color3d";
  WriteProgram("exit 0");
  EXPECT_THAT(
      Refusal(),
      testing::AllOf(HasSubstr("FAILED_PRECONDITION cannot create"), HasSubstr("XDG_DATA_HOME")));
}

TEST_F(LocalServerTest, WaitsForAnotherStartAndForDataFolder) {
  WriteProgram("echo started >>" + (scratch_.path() / "starts").string() + "; exit 3");
  fs::create_directories(options_.data_folder);
  // Another command is about to start one: this one takes it.
  const int starting =
      ::open((options_.data_folder / "start-lock").c_str(), O_RDWR | O_CREAT, 0600);
  ASSERT_EQ(::flock(starting, LOCK_EX), 0);
  int listener = -1;
  std::thread other([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    listener = ListenHere();
    ::close(starting);
  });
  EXPECT_EQ(Refusal(), "found " + LocalServerAddress(options_.data_folder));
  other.join();
  ::close(listener);
  EXPECT_FALSE(fs::exists(scratch_.path() / "starts"));
  // A server that is ending still holds the folder: none is started.
  const int in_use = ::open((options_.data_folder / "lock").c_str(), O_RDWR | O_CREAT, 0600);
  ASSERT_EQ(::flock(in_use, LOCK_EX), 0);
  options_.start_patience = seconds(1);
  EXPECT_THAT(Refusal(), HasSubstr("UNAVAILABLE the server of your own did not start"));
  EXPECT_FALSE(fs::exists(scratch_.path() / "starts"));
  ::close(in_use);
}

TEST_F(LocalServerTest, CanBeInterrupted) {
  WriteProgram("sleep 60");
  CancellationToken cancel;
  std::thread interrupter([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    cancel.Cancel();
  });
  EXPECT_THROW(FindOrStartServer(options_, say_, cancel), Error);
  interrupter.join();
}

}  // namespace
}  // namespace color3d::client
