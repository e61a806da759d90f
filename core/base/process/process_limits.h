// Resource limits of a process. The kernel ends a process or refuses a call beyond them.
#pragma once

#include <cstdint>
#include <string>

namespace color3d {

// 0: unchanged. No limit is ever raised; core dumps are always off.
struct ProcessLimits {
  int64_t memory_bytes = 0;  // private writable memory, without mapped files
  int64_t file_bytes = 0;    // of each file written; SIGXFSZ beyond
  int64_t cpu_seconds = 0;   // of all threads together; SIGXCPU beyond
  int64_t descriptors = 0;
  int64_t processes = 0;  // and threads, of the whole user; not counted for root
};

// Applies to the calling process and its children. Async-signal-safe; returns false with errno set
// if the kernel refuses.
bool LimitProcess(const ProcessLimits& limits) noexcept;

// Makes the kernel end this process and its children before others of the same user when the
// machine runs out of memory. Returns false if the kernel refuses.
bool PreferAsOomVictim() noexcept;

// Most likely limit exceeded by a process that was ended by `signal`, as a part of a sentence: "it
// wrote a file of more than 64 MiB".
std::string LikelyCause(int signal, const ProcessLimits& limits);

}  // namespace color3d
