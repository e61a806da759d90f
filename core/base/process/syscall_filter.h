// The system calls that a sandbox refuses, as a program for the kernel. For sandbox.cc only.
#pragma once

#include <linux/filter.h>

#include <vector>

#include "core/base/process/sandbox.h"

namespace color3d {

bool HasSyscallFilters();

// Calls that neither decoding nor computing needs give EPERM. Throws Error{kInternal} when
// libseccomp does not take a rule.
std::vector<sock_filter> CompileSyscallFilter(const SandboxRules& rules);

}  // namespace color3d
