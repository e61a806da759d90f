// How many threads torch may use in the calling thread's operations, and OpenBLAS (which has
// threads of its own) in the process's: threads that run torch side by side all set 1.
#pragma once

namespace color3d {

// 0: what the machine has. Callers that run an encoder on threads of their own set 1 on each.
// `blas_threads`: 0: as many as `threads`, which large products of matrices gain from. 1 for
// networks: OpenBLAS's threads spin while they wait, and take torch's processors (the automatic
// colourizer ran at half the speed on two); and where results must not depend on their number:
// OpenBLAS rounds otherwise with another one, on some processors.
void SetTorchThreads(int threads, int blas_threads = 0);

}  // namespace color3d
