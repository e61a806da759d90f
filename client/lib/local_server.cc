#include "client/lib/local_server.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <string_view>
#include <thread>
#include <vector>

#include "client/lib/connection.h"
#include "client/lib/detached_program.h"
#include "core/base/error.h"
#include "core/base/file_descriptor.h"
#include "core/base/files.h"
#include "core/base/text/address.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {
using std::chrono::steady_clock;

constexpr std::string_view kUnix = "unix:";

bool AcceptsOnSocket(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path)) return false;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const FileDescriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  return socket.get() >= 0 &&
         ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
}

bool AcceptsOnPort(const HostPort& place) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(place.host.c_str(), place.port.c_str(), &hints, &found) != 0) return false;
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> addresses(found, ::freeaddrinfo);
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    const FileDescriptor socket(::socket(one->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (socket.get() >= 0 && ::connect(socket.get(), one->ai_addr, one->ai_addrlen) == 0)
      return true;
  }
  return false;
}

// Held while a server is started, so that of several commands one starts it.
class StartLock {
 public:
  StartLock(const fs::path& folder, steady_clock::time_point end, const CancellationToken& cancel)
      : file_(::open((folder / "start-lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {
    if (file_.get() < 0) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "cannot write to {}: {}; free space or set XDG_DATA_HOME to another folder",
                  folder.string(),
                  std::strerror(errno));
    }
    while (::flock(file_.get(), LOCK_EX | LOCK_NB) != 0) {
      cancel.ThrowIfCancelled();
      if (steady_clock::now() > end) {
        throw Error(ErrorCode::kUnavailable,
                    "another command has been starting a server in {} for too long; end it and try "
                    "again",
                    folder.string());
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

 private:
  FileDescriptor file_;
};

// A server holds this lock from its start to its end (server/storage/data_folder.h).
bool IsDataFolderInUse(const fs::path& folder) {
  const FileDescriptor lock(::open((folder / "lock").c_str(), O_RDWR | O_CLOEXEC));
  return lock.get() >= 0 && ::flock(lock.get(), LOCK_EX | LOCK_NB) != 0;
}

pid_t StartServer(const std::vector<std::string>& arguments, const fs::path& log) {
  pid_t server = 0;
  const int error = StartDetached(arguments, log, &server);
  if (error != 0) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot start a server with {}: {}; install color3d-server beside color3d, or name "
                "a server that runs with --server",
                arguments[0],
                std::strerror(error));
  }
  return server;
}

std::string LastLine(const fs::path& log) {
  std::error_code error;
  if (!fs::exists(log, error)) return "no log";
  std::string text = ReadFile(log);
  while (text.ends_with('\n')) text.pop_back();
  const size_t begin = text.rfind('\n');
  return text.empty() ? "it wrote no log" : text.substr(begin == text.npos ? 0 : begin + 1);
}

fs::path PrepareFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot create {}: {}; set XDG_DATA_HOME to another folder",
                folder.string(),
                error.message());
  }
  ::chmod(folder.c_str(), 0700);
  return fs::absolute(folder);
}

}  // namespace

fs::path UserDataFolder() {
  const char* data = std::getenv("XDG_DATA_HOME");
  const char* home = std::getenv("HOME");
  if (data != nullptr && fs::path(data).is_absolute()) return fs::path(data) / "color3d";
  if (home != nullptr && *home != '\0') return fs::path(home) / ".local" / "share" / "color3d";
  return {};
}

fs::path ServerProgram() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error).parent_path() / "color3d-server";
}

std::string LocalServerAddress(const fs::path& data_folder) {
  return std::string(kUnix) + (fs::absolute(data_folder) / "server.sock").string();
}

bool AcceptsConnections(const std::string& address) {
  if (address.starts_with(kUnix)) return AcceptsOnSocket(address.substr(kUnix.size()));
  return AcceptsOnPort(SplitHostPort(address));
}

std::string FindServer(const fs::path& data_folder) {
  if (!data_folder.empty()) {
    std::string own = LocalServerAddress(data_folder);
    if (AcceptsConnections(own)) return own;
  }
  return AcceptsConnections(kDefaultServer) ? kDefaultServer : "";
}

std::string FindOrStartServer(const LocalServerOptions& options,
                              const std::function<void(const std::string& line)>& say,
                              const CancellationToken& cancel) {
  if (options.data_folder.empty()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "no server runs, and there is no home folder for the data of one; set "
                "XDG_DATA_HOME, or name a server with --server");
  }
  const std::string address = LocalServerAddress(options.data_folder);
  if (AcceptsConnections(address)) return address;
  if (::access(options.program.c_str(), X_OK) != 0) {
    throw Error(ErrorCode::kFailedPrecondition,
                "no server runs, and the program {} is missing; install it beside color3d, or name "
                "a server with --server",
                options.program.string());
  }
  const fs::path folder = PrepareFolder(options.data_folder);
  const fs::path log = folder / "server.log";
  const auto end = steady_clock::now() + options.start_patience;
  const StartLock starting(folder, end, cancel);
  pid_t child = 0;
  bool said = false;
  while (!AcceptsConnections(address)) {
    cancel.ThrowIfCancelled();
    if (child == 0 && !IsDataFolderInUse(folder)) {  // an ending server may still hold it
      if (!said)
        say(fmt::format("starting a server of your own; its files are in {}", folder.string()));
      said = true;
      child = StartServer({options.program.string(),
                           "serve",
                           "--data-dir",
                           folder.string(),
                           "--listen",
                           address,
                           "--idle-exit",
                           fmt::format("{}s", options.idle_exit.count())},
                          log);
    }
    int status = 0;
    const bool has_ended = child != 0 && ::waitpid(child, &status, WNOHANG) == child;
    if (has_ended || steady_clock::now() > end) {
      throw Error(ErrorCode::kUnavailable,
                  "the server of your own did not start: {} (all of it in {})",
                  LastLine(log),
                  log.string());
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return address;
}

}  // namespace color3d::client
