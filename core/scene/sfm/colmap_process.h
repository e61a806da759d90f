// COLMAP's program as a child process: one log, one time limit for all commands, progress counted
// from the log. For this folder only. Not thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/run_control.h"

namespace color3d {

// What one command prints while it works, and how often in all.
struct ColmapPhase {
  std::string message;  // "matching photos"
  std::string mark;     // in the log, once per step
  int64_t total = 0;
};

class ColmapProcess {
 public:
  // What `run` refers to outlives the object. The clock of the time limit starts now.
  ColmapProcess(std::filesystem::path log, std::chrono::seconds timeout, const RunControl& run);

  const std::filesystem::path& log() const { return log_; }
  // Adds a line of our own to the log.
  void Note(const std::string& line) const;
  // ... and tells the user.
  void Warn(const std::string& line) const;
  // The value of COLMAP's thread options.
  std::string Threads() const;

  // Runs `colmap arguments...` and returns the exit code. Throws Error: kDeadlineExceeded,
  // kCancelled, kResourceExhausted when memory ran out, kUnavailable when another signal ended it
  // (that is no answer, and worth another attempt), kFailedPrecondition when COLMAP is not
  // installed.
  int Run(const std::vector<std::string>& arguments, const ColmapPhase& phase);
  // Another exit code than 0 is Error{kInternal} with the last line of the log.
  void RunOrThrow(const std::vector<std::string>& arguments, const ColmapPhase& phase);

 private:
  [[noreturn]] void ThrowTooSlow() const;
  std::string LastLogLine() const;
  bool LogSays(const std::string& text) const;

  std::filesystem::path log_;
  std::chrono::seconds timeout_;
  RunControl run_;
  std::chrono::steady_clock::time_point deadline_;
};

}  // namespace color3d
