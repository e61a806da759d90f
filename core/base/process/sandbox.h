// Irrevocable sandbox for a process and its children, by seccomp and Landlock: code that decodes
// untrusted files gets access only to the resources that it needs. Requires no privileges.
#pragma once

#include <linux/filter.h>

#include <filesystem>
#include <string>
#include <vector>

namespace color3d {

enum class Sockets {
  kNone,   // socket pairs and pipes only
  kLocal,  // Unix sockets
  kAll,    // and Internet sockets
};

struct SandboxRules {
  // Folders (with their contents) and files; missing ones are skipped. Programs, libraries and
  // settings of the system are readable in addition; of /etc only the files that programs need.
  std::vector<std::filesystem::path> readable;  // and executable
  std::vector<std::filesystem::path> writable;  // and readable
  Sockets sockets = Sockets::kNone;
  bool may_start_processes = false;  // threads are always allowed
};

// Rules compiled in advance, because few calls are allowed between fork and exec.
class Sandbox {
 public:
  // Features that the machine lacks are skipped and listed in missing(). Throws Error{kInternal} if
  // the kernel rejects the rules.
  explicit Sandbox(const SandboxRules& rules);
  ~Sandbox();
  Sandbox(const Sandbox&) = delete;
  Sandbox& operator=(const Sandbox&) = delete;

  // Applies to the calling thread and everything it starts from then on, including programs; cannot
  // be undone. Async-signal-safe; returns false with errno set if the kernel refuses.
  bool Enter() const noexcept;

  // "seccomp, Landlock ABI 7"; empty if the machine has neither.
  const std::string& active() const { return active_; }
  // "Landlock ABI 2 (Linux 5.19)"; empty if nothing is missing.
  const std::string& missing() const { return missing_; }

 private:
  std::vector<sock_filter> filter_;  // empty: no seccomp
  int ruleset_ = -1;                 // -1: no Landlock
  std::string active_;
  std::string missing_;
};

// True if programs that this process starts for untrusted files run in a sandbox: the default,
// unless disabled at startup.
void SetSandboxing(bool on);
bool IsSandboxing();

}  // namespace color3d
