#include "core/encoder/torch_threads.h"

#include <ATen/Parallel.h>

#include <algorithm>
#include <thread>

namespace color3d {

void SetTorchThreads(int threads) {
  if (threads <= 0) threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  if (at::get_num_threads() != threads) at::set_num_threads(threads);
}

}  // namespace color3d
