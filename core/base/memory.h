// How much memory this process takes, and may still take. Thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>

namespace color3d {

// The least of MemAvailable and of what the process's control groups (version 1 or 2) leave below
// their limits, bytes; INT64_MAX when the system tells neither. `root` stands for "/" in tests.
int64_t AvailableMemoryBytes(const std::filesystem::path& root = "/");

// Resident memory now; 0 when unknown.
int64_t ResidentMemoryBytes();

// Largest resident memory since the last reset (or since the start, where the kernel cannot reset).
int64_t PeakMemoryBytes();
void ResetPeakMemory();

// Gives back to the system what was freed: glibc keeps it else, hundreds of MiB of a stage that has
// ended. Costs some ms; no effect without glibc.
void ReleaseFreedMemory();

// Lets all threads allocate from at most `arenas` (>= 1) pools. glibc gives each thread one of its
// own, which keeps what was freed in it: threads that take turns would keep a turn's memory each.
// To be called before threads are started; no effect without glibc.
void ShareMallocArenas(int arenas);

}  // namespace color3d
