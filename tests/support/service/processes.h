// Processes for tests: started in their own group, with a time limit, and always killed at the end
// of the test. Not thread-safe.
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
  int exit_code = -1;  // 128 + signal if killed, -1 if it exceeded its time limit
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
  // Returns the exit code, or nullopt if it still runs after `limit`.
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

// Runs a program to its end, or kills it after `limit`.
ProcessResult RunProcess(const std::vector<std::string>& arguments,
                         const std::filesystem::path& log_folder,
                         std::chrono::seconds limit);

// All living descendants of `pid`.
std::vector<pid_t> Descendants(pid_t pid);
bool IsAlive(pid_t pid);

// Polls until `condition` holds; returns false after `limit`.
bool WaitUntil(const std::function<bool()>& condition,
               std::chrono::milliseconds limit,
               std::chrono::milliseconds step = std::chrono::milliseconds(50));

}  // namespace color3d
