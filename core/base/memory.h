// Memory used by and available to this process. Thread-safe.
#pragma once

#include <cstdint>
#include <exception>
#include <filesystem>
#include <string>

namespace color3d {

// Minimum of MemAvailable and of the memory left below the limits of the process's control groups
// (version 1 or 2), in bytes; INT64_MAX if the system reports neither. `root` replaces "/" in
// tests.
int64_t AvailableOnMachineBytes(const std::filesystem::path& root = "/");

// Minimum of MemTotal and of the limits of the process's control groups, in bytes; INT64_MAX if the
// system reports neither.
int64_t MachineMemoryBytes(const std::filesystem::path& root = "/");

// Limit on this process's own writable memory (ProcessLimits::memory_bytes, RLIMIT_DATA), in bytes;
// INT64_MAX without one.
int64_t OwnMemoryLimitBytes();

// Memory that counts towards that limit: private writable memory, used or only reserved, in bytes;
// 0 if unknown.
int64_t OwnMemoryBytes();

// Remainder of the limit, in bytes; INT64_MAX without one.
int64_t OwnMemoryLeftBytes();

// Memory that this process may still allocate: the minimum of AvailableOnMachineBytes and
// OwnMemoryLeftBytes.
int64_t AvailableMemoryBytes(const std::filesystem::path& root = "/");

// Returns true if `error` means that memory ran out: std::bad_alloc, or an exception of a library
// with such a text (torch, OpenCV, a thread without memory for its stack).
bool IsOutOfMemory(const std::exception& error);

// Remedy for too little memory, as a part of a sentence: "give workers more than 2048 MiB each
// (color3d-server serve --worker-memory-mib)" if the process has a limit, else "use a machine with
// more memory".
std::string MemoryRemedy();

// Current resident memory; 0 if unknown.
int64_t ResidentMemoryBytes();

// Peak resident memory since the last reset (or since the start, if the kernel cannot reset it).
int64_t PeakMemoryBytes();
void ResetPeakMemory();

// Returns freed memory to the system; glibc would otherwise keep it, hundreds of MiB after a stage
// has ended. Takes some ms; no effect without glibc.
void ReleaseFreedMemory();

// Limits all threads to `arenas` (>= 1) malloc pools. By default glibc gives each thread a pool of
// its own, which keeps the memory freed in it, so threads that work in turns would each hold the
// memory of a turn. Call before starting threads; no effect without glibc.
void ShareMallocArenas(int arenas);

// Keeps freed memory, up to some hundred MB, until ReleaseFreedMemory(). By default glibc returns
// large blocks to the system, which clears their pages each time they are allocated again. No
// effect without glibc.
void KeepFreedMemory();

}  // namespace color3d
