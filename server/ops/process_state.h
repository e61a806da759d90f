// Other processes, as /proc tells. Pure but for that; thread-safe.
#pragma once

#include <sys/types.h>

namespace color3d {

// 'R', 'S', 'T' (stopped), 'Z' (ended and not waited for), ... as in proc(5); 0: there is none.
char ProcessState(pid_t pid);

// Neither gone nor ended.
bool IsRunning(pid_t pid);
// By a signal or a debugger.
bool IsStopped(pid_t pid);

}  // namespace color3d
