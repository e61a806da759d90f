// Landlock rules for the parts of the file system that a sandbox may access. For sandbox.cc only.
#pragma once

#include "core/base/process/sandbox.h"

namespace color3d {

// First version that allows linking and renaming files between folders (Linux 5.19).
constexpr int kLeastLandlockAbi = 2;

// 0 if the kernel has no Landlock or it is disabled.
int LandlockAbi();

// Creates a ruleset for landlock_restrict_self with all access rights of this version, closed on
// exec. The caller closes it. Throws Error{kInternal}.
int OpenLandlockRuleset(const SandboxRules& rules, int abi);

}  // namespace color3d
