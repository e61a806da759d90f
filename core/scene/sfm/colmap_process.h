// Runs COLMAP as a child process: one log, one time limit for all commands, progress counted from
// the log. For this folder only. Not thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/run_control.h"

namespace color3d {

// Line that one command prints as it works, and how often in total.
struct ColmapPhase {
  std::string message;  // "matching photos"
  std::string mark;     // in the log, once per step
  int64_t total = 0;
};

class ColmapProcess {
 public:
  // Objects that `run` refers to must outlive this. The time limit starts now.
  ColmapProcess(std::filesystem::path log, std::chrono::seconds timeout, const RunControl& run);

  const std::filesystem::path& log() const { return log_; }
  // Adds a line of our own to the log.
  void Note(const std::string& line) const;
  // Adds a line to the log and warns the user.
  void Warn(const std::string& line) const;
  // Value for COLMAP's thread options.
  std::string Threads() const;

  // Runs `colmap arguments...` and returns the exit code. Throws Error: kDeadlineExceeded,
  // kCancelled, kResourceExhausted if memory ran out, kUnavailable if another signal ended it
  // (another attempt may succeed), kFailedPrecondition if COLMAP is not installed.
  int Run(const std::vector<std::string>& arguments, const ColmapPhase& phase);
  // As Run, but throws Error{kInternal} with the last line of the log for an exit code other than
  // 0.
  void RunOrThrow(const std::vector<std::string>& arguments, const ColmapPhase& phase);

 private:
  [[noreturn]] void ThrowTooSlow() const;
  std::string LastLogLine() const;
  bool LogContains(const std::string& text) const;

  std::filesystem::path log_;
  std::chrono::seconds timeout_;
  RunControl run_;
  std::chrono::steady_clock::time_point deadline_;
};

}  // namespace color3d
