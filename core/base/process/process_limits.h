// What a process may take of the machine. The kernel ends or refuses what goes beyond.
#pragma once

#include <cstdint>
#include <string>

namespace color3d {

// 0: as it is. No limit is ever raised; core dumps are always off.
struct ProcessLimits {
  int64_t memory_bytes = 0;  // its own writable memory, what files are mapped to not counted
  int64_t file_bytes = 0;    // of each file that it writes; more is SIGXFSZ
  int64_t cpu_seconds = 0;   // of all its threads together; more is SIGXCPU
  int64_t descriptors = 0;
  int64_t processes = 0;  // and threads, of the user's in all; root's are not counted
};

// For the calling process and all that it starts. Async-signal-safe; false with errno when the
// kernel refuses.
bool LimitProcess(const ProcessLimits& limits) noexcept;

// When the machine's memory runs out, the kernel ends this process and what it starts before others
// of its user's. False when the kernel does not take it.
bool BeEndedFirstWhenMemoryRunsOut() noexcept;

// What a process that was ended by `signal` most likely ran into, as a part of a sentence:
// "it wrote a file of more than 64 MiB".
std::string LikelyCause(int signal, const ProcessLimits& limits);

}  // namespace color3d
