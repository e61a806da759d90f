// Runs a child program with limits, a log file, cancellation and an optional sandbox. Never leaves
// a child behind.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/process/process_limits.h"
#include "core/base/process/sandbox.h"

namespace color3d {

struct SubprocessOptions {
  std::vector<std::string> arguments;    // arguments[0] is searched in PATH
  std::vector<std::string> environment;  // "NAME=value", added to those inherited (environment.h)
  std::filesystem::path log_path;        // stdout and stderr are appended here; empty: discarded
  std::chrono::seconds timeout{3600};
  ProcessLimits limits;
  std::optional<SandboxRules> sandbox;  // the program itself is readable in addition
};

struct SubprocessResult {
  int exit_code = 0;  // 128 + signal when killed
  int signal = 0;     // signal that ended the child; 0: it exited
  bool timed_out = false;
  double seconds = 0.0;
};

// Starts the child in its own process group, waits, and kills the whole group on time-out or
// cancellation (then throws Error{kCancelled}). The child has the default actions of all signals
// and dies with the calling thread. Throws Error{kFailedPrecondition} if the program is not
// installed.
SubprocessResult RunSubprocess(const SubprocessOptions& options, const CancellationToken& cancel);

// Returns true for a child of RunSubprocess, whose exit status no other thread may take.
bool IsSubprocess(pid_t process);

}  // namespace color3d
