// How many threads torch may use in the calling thread's operations, and OpenBLAS (which has
// threads of its own) in the process's: threads that run torch side by side all set 1.
#pragma once

namespace color3d {

// 0: what the machine has. Callers that run an encoder on threads of their own set 1 on each.
void SetTorchThreads(int threads);

}  // namespace color3d
