#include "core/base/process/sandbox.h"

#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>

#include "core/base/process/landlock.h"
#include "core/base/process/syscall_filter.h"

namespace color3d {
namespace {

std::atomic<bool> g_sandboxing{true};

void Append(std::string* list, const std::string& item) {
  *list += (list->empty() ? "" : ", ") + item;
}

}  // namespace

Sandbox::Sandbox(const SandboxRules& rules) {
  if (HasSyscallFilters()) {
    filter_ = CompileSyscallFilter(rules);
    Append(&active_, "seccomp");
  } else {
    Append(&missing_, "seccomp filters");
  }
  const int abi = LandlockAbi();
  if (abi >= kLeastLandlockAbi) {
    ruleset_ = OpenLandlockRuleset(rules, abi);
    Append(&active_, "Landlock ABI " + std::to_string(abi));
  } else {
    Append(&missing_, "Landlock ABI " + std::to_string(kLeastLandlockAbi) + " (Linux 5.19)");
  }
}

Sandbox::~Sandbox() {
  if (ruleset_ >= 0) ::close(ruleset_);
}

bool Sandbox::Enter() const noexcept {
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return false;
  if (ruleset_ >= 0 && ::syscall(SYS_landlock_restrict_self, ruleset_, 0) != 0) return false;
  if (filter_.empty()) return true;
  const sock_fprog program{static_cast<unsigned short>(filter_.size()),
                           const_cast<sock_filter*>(filter_.data())};
  return ::syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, 0, &program) == 0;
}

void SetSandboxing(bool on) { g_sandboxing = on; }
bool IsSandboxing() { return g_sandboxing; }

}  // namespace color3d
