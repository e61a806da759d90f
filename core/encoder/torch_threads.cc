#include "core/encoder/torch_threads.h"

#include <ATen/Parallel.h>
#include <dlfcn.h>

#include <algorithm>
#include <atomic>
#include <thread>

namespace color3d {
namespace {

// OpenBLAS has its own threads, unknown to torch: they spin while waiting, and concurrent callers
// block each other. Null if another BLAS is loaded.
using SetBlasThreads = void (*)(int);
SetBlasThreads FindSetBlasThreads() {
  return reinterpret_cast<SetBlasThreads>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"));
}

int ResolveThreads(int threads) {
  return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace

void SetTorchThreads(int threads, int blas_threads) {
  threads = ResolveThreads(threads);
  if (blas_threads == 0) blas_threads = threads;
  static const SetBlasThreads set_blas_threads = FindSetBlasThreads();
  static std::atomic<int> now = 0;
  if (set_blas_threads != nullptr && now.exchange(blas_threads) != blas_threads) {
    set_blas_threads(blas_threads);
  }
  if (at::get_num_threads() != threads) at::set_num_threads(threads);
}

}  // namespace color3d
