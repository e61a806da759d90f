// How many threads torch may use in the calling thread's operations, and OpenBLAS (which has
// threads of its own) in the process's: threads that run torch side by side all set 1.
#pragma once

namespace color3d {

// 0: what the machine has. Callers that run an encoder on threads of their own set 1 on each.
// `blas_threads`: OpenBLAS rounds otherwise with another number of threads, on some processors;
// 1 where results must not depend on it. 0: as many as `threads`.
void SetTorchThreads(int threads, int blas_threads = 0);

}  // namespace color3d
