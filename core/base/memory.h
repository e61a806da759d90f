// How much memory this process takes, and may still take. Thread-safe.
#pragma once

#include <cstdint>
#include <exception>
#include <filesystem>
#include <string>

namespace color3d {

// The least of MemAvailable and of what the process's control groups (version 1 or 2) leave below
// their limits, bytes; INT64_MAX when the system tells neither. `root` stands for "/" in tests.
int64_t AvailableOnMachineBytes(const std::filesystem::path& root = "/");

// The least of MemTotal and of the limits of the process's control groups, bytes; INT64_MAX when
// the system tells neither.
int64_t MachineMemoryBytes(const std::filesystem::path& root = "/");

// The limit on this process's own writable memory (ProcessLimits::memory_bytes, RLIMIT_DATA),
// bytes; INT64_MAX without one.
int64_t OwnMemoryLimitBytes();

// What that limit counts: private writable memory that is reserved, used or not, bytes; 0 when
// unknown.
int64_t OwnMemoryBytes();

// What is left of the limit, bytes; INT64_MAX without one.
int64_t OwnMemoryLeftBytes();

// What this process may still take: the least of AvailableOnMachineBytes and OwnMemoryLeftBytes.
int64_t AvailableMemoryBytes(const std::filesystem::path& root = "/");

// True when `error` says that memory ran out: std::bad_alloc, or a library's exception with such a
// text (torch, OpenCV, a thread that has no room for its stack).
bool IsOutOfMemory(const std::exception& error);

// What to do about it, as a part of a sentence: "give workers more than 2048 MiB each
// (color3d-server serve --worker-memory-mib)" where the process has a limit, else "use a machine
// with more memory".
std::string MemoryRemedy();

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
