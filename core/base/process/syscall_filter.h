// The system call filter of a sandbox, as a BPF program. For sandbox.cc only.
#pragma once

#include <linux/filter.h>

#include <vector>

#include "core/base/process/sandbox.h"

namespace color3d {

bool HasSyscallFilters();

// Calls that neither decoding nor computing needs return EPERM. Throws Error{kInternal} if
// libseccomp rejects a rule.
std::vector<sock_filter> CompileSyscallFilter(const SandboxRules& rules);

}  // namespace color3d
