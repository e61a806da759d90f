// File that reserves disk space: on a full disk even a deletion needs a few MiB, for the log of the
// job store. Thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "core/base/error.h"
#include "core/base/mutex.h"

namespace color3d {

class Ballast {
 public:
  // `bytes`: length of the file. Reuses the file of an earlier server.
  Ballast(std::filesystem::path file, int64_t bytes);

  int64_t bytes() const { return bytes_; }
  bool IsThere() const;
  // Creates the whole file or none; returns true if it exists now.
  bool Make();
  // Deletes the file; returns true if that freed space.
  bool Release();

 private:
  const std::filesystem::path file_;
  const int64_t bytes_;
  mutable Mutex mutex_;  // one call at a time
};

// Returns the length of the ballast for the disk of a folder: 16 MiB, at most a twentieth of the
// disk.
int64_t BallastBytes(const std::filesystem::path& folder);

// Calls `body`, which frees space. If the disk is too full for that, calls it again after
// `make_room` (may be empty) has freed some.
template <typename Body>
auto RetryAfterMakingRoom(const std::function<bool()>& make_room, const Body& body) {
  try {
    return body();
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kResourceExhausted || !make_room || !make_room()) throw;
  }
  return body();
}

}  // namespace color3d
