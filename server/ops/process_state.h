// States of other processes, from /proc. Thread-safe.
#pragma once

#include <sys/types.h>

namespace color3d {

// Returns 'R', 'S', 'T' (stopped), 'Z' (zombie), ... as in proc(5), or 0 if there is no such
// process.
char ProcessState(pid_t pid);

// Returns whether the process exists and is not a zombie.
bool IsRunning(pid_t pid);
// Returns whether the process is stopped by a signal or a debugger.
bool IsStopped(pid_t pid);

}  // namespace color3d
