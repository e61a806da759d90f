// Limit and number of open descriptors of this process. Thread-safe.
#pragma once

#include <cstdint>

namespace color3d {

// Raises the soft limit of descriptors to the hard limit, which needs no privilege. Returns the
// limit.
int64_t RaiseDescriptorLimit();

int64_t DescriptorLimit();
// Returns 0 if /proc is not available.
int64_t OpenDescriptors();

}  // namespace color3d
