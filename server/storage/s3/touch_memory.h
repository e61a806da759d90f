// What this process has touched lately, so that a blob that is touched again soon costs no request.
// Thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "core/base/digest.h"
#include "core/base/mutex.h"

namespace color3d {

class TouchMemory {
 public:
  // Forgets a touch after `keep`, which must be well below the time for which a touch protects.
  explicit TouchMemory(std::chrono::milliseconds keep) : keep_(keep) {}

  // Notes a touch that was written to the store. `mark`: its ETag.
  void Add(const FileDigest& digest, const std::string& mark);
  // Returns true if the blob was touched lately, and counts that touch.
  bool Again(const FileDigest& digest);
  // Number of touches that were only counted; changes with each.
  int64_t Repeats(const std::string& sha256) const;
  // Returns true if this mark was written by this process lately.
  bool IsOwn(const std::string& sha256, const std::string& mark) const;
  void Forget(const std::string& sha256);
  // Forgets the blob if it had this number of repeated touches; returns false otherwise.
  bool Retire(const std::string& sha256, int64_t repeats);

 private:
  using Time = std::chrono::steady_clock::time_point;
  struct Touch {
    int64_t size_bytes = 0;
    std::string mark;
    Time at;
    int64_t repeats = 0;
  };
  // Removes entries that are over, now and then.
  void Prune(Time now) COLOR3D_REQUIRES(mutex_);

  const std::chrono::milliseconds keep_;
  mutable Mutex mutex_;
  std::map<std::string, Touch> touches_ COLOR3D_GUARDED_BY(mutex_);
  Time next_prune_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d
