// How many threads torch may use in the calling thread's operations.
#pragma once

namespace color3d {

// 0: what the machine has.
void SetTorchThreads(int threads);

}  // namespace color3d
