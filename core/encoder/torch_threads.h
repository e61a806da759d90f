// Number of threads of torch in the calling thread, and of OpenBLAS (which has its own threads) in
// the process. Threads that run torch concurrently should all set 1.
#pragma once

namespace color3d {

// Sets both numbers. `threads`: 0: one per core; callers that run an encoder on several threads set
// 1 on each. `blas_threads`: 0: as many as `threads`, for large matrix products. Use 1 for
// networks, because waiting threads of OpenBLAS spin and occupy the processors of torch (the
// automatic colourizer ran at half the speed on two cores), and where results must not depend on
// the number of threads, since the rounding of OpenBLAS does on some processors.
void SetTorchThreads(int threads, int blas_threads = 0);

}  // namespace color3d
