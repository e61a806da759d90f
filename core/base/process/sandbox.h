// Locks a process in for good, and all that it starts: what decodes strangers' files gets no more
// of the machine than its work needs. By seccomp and Landlock; no rights are needed for it.
#pragma once

#include <linux/filter.h>

#include <filesystem>
#include <string>
#include <vector>

namespace color3d {

enum class Sockets {
  kNone,   // pairs and pipes only
  kLocal,  // Unix sockets
  kAll,    // and the internet's
};

struct SandboxRules {
  // Folders, with all below them, and files; what does not exist is left out. The system's own
  // programs, libraries and settings may be read besides; of /etc only what programs need.
  std::vector<std::filesystem::path> readable;  // and executable
  std::vector<std::filesystem::path> writable;  // and readable
  Sockets sockets = Sockets::kNone;
  bool may_start_processes = false;  // threads it may, always
};

// What the kernel is told, prepared beforehand, because little is allowed between fork and exec.
class Sandbox {
 public:
  // What the machine does not have is left out and said in missing(). Throws Error{kInternal} when
  // what it has does not take the rules.
  explicit Sandbox(const SandboxRules& rules);
  ~Sandbox();
  Sandbox(const Sandbox&) = delete;
  Sandbox& operator=(const Sandbox&) = delete;

  // The calling thread and all that it starts from now on, programs too; there is no way back.
  // Async-signal-safe; false with errno when the kernel refuses.
  bool Enter() const noexcept;

  // "seccomp, Landlock ABI 7"; empty when the machine has none.
  const std::string& active() const { return active_; }
  // "Landlock ABI 2 (Linux 5.19)"; empty when nothing is missing.
  const std::string& missing() const { return missing_; }

 private:
  std::vector<sock_filter> filter_;  // empty: no seccomp
  int ruleset_ = -1;                 // -1: no Landlock
  std::string active_;
  std::string missing_;
};

// Whether programs that this process starts for strangers' files are locked in: yes, unless it was
// switched off at the start.
void SetSandboxing(bool on);
bool IsSandboxing();

}  // namespace color3d
