// How many files and sockets this process may have open, and has. Thread-safe.
#pragma once

#include <cstdint>

namespace color3d {

// Raises the soft limit of descriptors to the hard one, which needs no rights. Returns the limit.
int64_t RaiseDescriptorLimit();

int64_t DescriptorLimit();
// 0 where /proc does not tell.
int64_t OpenDescriptors();

}  // namespace color3d
