// What a sandbox may reach of the file system, as the kernel's Landlock takes it. For sandbox.cc
// only.
#pragma once

#include "core/base/process/sandbox.h"

namespace color3d {

// The first that lets files be linked and renamed from one folder to another (Linux 5.19).
constexpr int kLeastLandlockAbi = 2;

// 0: the kernel has no Landlock, or it is switched off.
int LandlockAbi();

// A ruleset for landlock_restrict_self with all that this version knows, closed on exec; the caller
// closes it. Throws Error{kInternal}.
int OpenLandlockRuleset(const SandboxRules& rules, int abi);

}  // namespace color3d
