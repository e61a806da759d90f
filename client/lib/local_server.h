// A server of the user's own, started by the first command that needs one and ended when idle.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>

#include "core/base/cancellation.h"

namespace color3d::client {

struct LocalServerOptions {
  std::filesystem::path program;            // color3d-server
  std::filesystem::path data_folder;        // created if missing
  std::chrono::seconds idle_exit{1800};     // it ends after this time without work or calls
  std::chrono::seconds start_patience{60};  // also for an ending server to release the folder
};

// "color3d" in $XDG_DATA_HOME or ~/.local/share; empty without a home.
std::filesystem::path UserDataFolder();

// "color3d-server" beside this program.
std::filesystem::path ServerProgram();

// Address of the user's own server: a socket in the data folder, which other users cannot open.
std::string LocalServerAddress(const std::filesystem::path& data_folder);

// Returns true if a process accepts connections at HOST:PORT or unix:PATH of this machine.
bool AcceptsConnections(const std::string& address);

// Returns the address of a running server: the user's own, else kDefaultServer. Empty if neither
// accepts connections.
std::string FindServer(const std::filesystem::path& data_folder);

// Returns the address of the user's own server. Starts it if none runs, after `say` with a line for
// the user; of several commands one starts it. It outlives this process and logs to server.log in
// the data folder. Throws Error{kFailedPrecondition} if the program is missing or the folder cannot
// be used, Error{kUnavailable} with the last line of the log if the server does not start, and
// Error{kCancelled}.
std::string FindOrStartServer(const LocalServerOptions& options,
                              const std::function<void(const std::string& line)>& say,
                              const CancellationToken& cancel);

}  // namespace color3d::client
