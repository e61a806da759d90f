// A file that takes some of the disk, so that it can be given up: on a full disk even a deletion
// needs a few MiB, for the job store's log. Thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "core/base/error.h"
#include "core/base/mutex.h"

namespace color3d {

class Ballast {
 public:
  // `bytes`: how long it is once it is made. One that an earlier server left is taken over.
  Ballast(std::filesystem::path file, int64_t bytes);

  int64_t bytes() const { return bytes_; }
  bool IsThere() const;
  // Makes it, whole or not at all; whether it is there now.
  bool Make();
  // Gives it up; whether that has freed anything.
  bool Release();

 private:
  const std::filesystem::path file_;
  const int64_t bytes_;
  mutable Mutex mutex_;  // one call at a time
};

// How long the ballast of a folder's disk is: 16 MiB, and at most a twentieth of the disk.
int64_t BallastBytes(const std::filesystem::path& folder);

// Does what frees space. Where the disk is too full for that it is done again once `make_room`,
// which may be empty, has given something up.
template <typename Body>
auto WithRoomMade(const std::function<bool()>& make_room, const Body& body) {
  try {
    return body();
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kResourceExhausted || !make_room || !make_room()) throw;
  }
  return body();
}

}  // namespace color3d
