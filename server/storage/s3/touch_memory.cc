#include "server/storage/s3/touch_memory.h"

namespace color3d {

void TouchMemory::Add(const FileDigest& digest, const std::string& mark) {
  const Time now = std::chrono::steady_clock::now();
  const MutexLock lock(mutex_);
  Prune(now);
  touches_[digest.sha256] = {digest.size_bytes, mark, now, 0};
}

bool TouchMemory::Again(const FileDigest& digest) {
  const Time now = std::chrono::steady_clock::now();
  const MutexLock lock(mutex_);
  const auto touch = touches_.find(digest.sha256);
  if (touch == touches_.end() || touch->second.size_bytes != digest.size_bytes ||
      now - touch->second.at >= keep_) {
    return false;
  }
  ++touch->second.repeats;
  return true;
}

int64_t TouchMemory::Repeats(const std::string& sha256) const {
  const MutexLock lock(mutex_);
  const auto touch = touches_.find(sha256);
  return touch == touches_.end() ? 0 : touch->second.repeats;
}

bool TouchMemory::IsOwn(const std::string& sha256, const std::string& mark) const {
  const MutexLock lock(mutex_);
  const auto touch = touches_.find(sha256);
  return touch != touches_.end() && touch->second.mark == mark;
}

void TouchMemory::Forget(const std::string& sha256) {
  const MutexLock lock(mutex_);
  touches_.erase(sha256);
}

bool TouchMemory::Retire(const std::string& sha256, int64_t repeats) {
  const MutexLock lock(mutex_);
  const auto touch = touches_.find(sha256);
  if (touch == touches_.end()) return repeats == 0;
  if (touch->second.repeats != repeats) return false;
  touches_.erase(touch);
  return true;
}

// Entries are kept for longer than they are used, so that the owner of a young mark stays known.
void TouchMemory::Prune(Time now) {
  if (now < next_prune_) return;
  next_prune_ = now + keep_;
  std::erase_if(touches_, [&](const auto& entry) { return now - entry.second.at >= 4 * keep_; });
}

}  // namespace color3d
