// Real processes for tests: started in a group of their own, watched with a time limit, and never
// left behind, whatever the test does. Not thread-safe.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace color3d {

struct ProcessResult {
  int exit_code = -1;  // 128 + signal when killed, -1 when it had to be killed for its time limit
  bool timed_out = false;
  double seconds = 0.0;
  std::string out;
  std::string err;
};

// A running child. stdout and stderr go to files, so a full pipe never blocks it.
class Process {
 public:
  // Starts arguments[0] (a path, or a name on PATH). The child dies with us.
  Process(std::vector<std::string> arguments, const std::filesystem::path& log_folder);
  // Kills the child and everything that it started.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  bool IsRunning();
  void Signal(int signal);
  // nullopt when it still runs after `limit`; the exit code otherwise.
  std::optional<int> Wait(std::chrono::milliseconds limit);
  void Kill();
  std::string Out() const;
  std::string Err() const;

 private:
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
  std::filesystem::path out_path_;
  std::filesystem::path err_path_;
};

// Runs to the end, or kills it after `limit`.
ProcessResult RunProcess(const std::vector<std::string>& arguments,
                         const std::filesystem::path& log_folder,
                         std::chrono::seconds limit);

// All living processes that descend from `pid`, it not included.
std::vector<pid_t> Descendants(pid_t pid);
bool IsAlive(pid_t pid);

// Polls until `condition` holds; false when `limit` has passed.
bool WaitUntil(const std::function<bool()>& condition,
               std::chrono::milliseconds limit,
               std::chrono::milliseconds step = std::chrono::milliseconds(50));

}  // namespace color3d
