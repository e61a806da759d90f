#include "core/encoder/threads.h"

#include <ATen/Parallel.h>

namespace color3d {

void UseOneTorchThread() { at::set_num_threads(1); }

}  // namespace color3d
