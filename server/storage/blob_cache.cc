#include "server/storage/blob_cache.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr char kPart[] = ".part";

// The order of use survives a restart as the order of the files' times.
void NoteUse(const fs::path& file) {
  const timespec times[2] = {{0, UTIME_OMIT}, {0, UTIME_NOW}};
  ::utimensat(AT_FDCWD, file.c_str(), times, 0);
}

bool HasLinkElsewhere(const fs::path& file) {
  struct stat status {};
  return ::stat(file.c_str(), &status) == 0 && status.st_nlink > 1;
}

}  // namespace

BlobCache::BlobCache(const fs::path& folder, int64_t budget_bytes)
    : folder_(folder), budget_bytes_(budget_bytes) {
  std::error_code error;
  fs::create_directories(folder_, error);
  std::vector<std::pair<fs::file_time_type, std::string>> found;
  const MutexLock lock(mutex_);
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    const std::string name = entry.path().filename().string();
    std::error_code none;
    if (name.ends_with(kPart)) fs::remove(entry.path(), none);
    if (IsSha256Hex(name) && entry.is_regular_file(none)) {
      Entry& known = entries_[name];
      known.bytes = static_cast<int64_t>(entry.file_size(none));
      known.present = true;
      bytes_ += known.bytes;
      found.emplace_back(entry.last_write_time(none), name);
    }
  }
  if (error) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot use the cache folder {}: {}; change its permissions, or choose another "
                "(--cache-dir of a worker)",
                folder_.string(),
                error.message());
  }
  std::sort(found.begin(), found.end());
  for (const auto& [time, name] : found) entries_[name].last_use = ++uses_;
  Trim();
}

int64_t BlobCache::bytes() const {
  const MutexLock lock(mutex_);
  return bytes_;
}

CacheUse BlobCache::use() const {
  const MutexLock lock(mutex_);
  return {bytes_, budget_bytes_, hit_bytes_, miss_bytes_};
}

void BlobCache::Pin(const std::string& sha256) {
  const MutexLock lock(mutex_);
  Entry& entry = entries_[sha256];
  ++entry.pins;
  entry.last_use = ++uses_;
}

void BlobCache::Unpin(const std::string& sha256) {
  const MutexLock lock(mutex_);
  const auto entry = entries_.find(sha256);
  if (--entry->second.pins == 0 && !entry->second.present) entries_.erase(entry);
  Trim();
}

void BlobCache::Use(const std::string& sha256,
                    const std::function<void(const fs::path&)>& fill,
                    const std::function<void(const fs::path&)>& use) {
  if (!IsSha256Hex(sha256)) {
    throw InvalidArgument("'{}' is not a SHA-256 digest: 64 lower-case hexadecimal digits",
                          sha256.substr(0, 80));
  }
  Pin(sha256);
  const std::shared_ptr<void> unpin(nullptr, [&](void*) { Unpin(sha256); });
  const bool was_filled = MakeReady(sha256, fill);
  {
    const MutexLock lock(mutex_);
    (was_filled ? miss_bytes_ : hit_bytes_) += entries_.at(sha256).bytes;
  }
  NoteUse(PathOf(sha256));
  use(PathOf(sha256));
}

bool BlobCache::MakeReady(const std::string& sha256,
                          const std::function<void(const fs::path&)>& fill) {
  bool present = false;
  {
    MutexLock lock(mutex_);
    Entry& entry = entries_.at(sha256);
    while (entry.filling) filled_.Wait(mutex_);
    std::error_code none;
    if (entry.present && entry.verified && fs::exists(PathOf(sha256), none)) return false;
    entry.filling = true;
    present = entry.present;
  }
  const std::shared_ptr<void> done(nullptr, [&](void*) {
    const MutexLock lock(mutex_);
    entries_.at(sha256).filling = false;
    filled_.NotifyAll();
  });
  const fs::path file = PathOf(sha256);
  if (present) {
    std::error_code none;
    if (fs::exists(file, none) && DigestFile(file).sha256 == sha256) {
      Accept(sha256, file);
      return false;
    }
    spdlog::warn("the cached file {} is damaged; it is fetched again", file.string());
    fs::remove(file, none);
  }
  const fs::path part = file.string() + kPart;
  fill(part);
  ::chmod(part.c_str(), 0444);
  PublishFile(part, file);
  Accept(sha256, file);
  return true;
}

void BlobCache::Accept(const std::string& sha256, const fs::path& file) {
  std::error_code error;
  const auto size = static_cast<int64_t>(fs::file_size(file, error));
  const MutexLock lock(mutex_);
  Entry& entry = entries_[sha256];
  bytes_ += (error ? 0 : size) - entry.bytes;
  entry.bytes = error ? 0 : size;
  entry.present = entry.verified = true;
  entry.last_use = std::max(entry.last_use, ++uses_);
}

void BlobCache::Put(const fs::path& file, const FileDigest& digest) {
  Pin(digest.sha256);
  const std::shared_ptr<void> unpin(nullptr, [&](void*) { Unpin(digest.sha256); });
  MakeReady(digest.sha256, [&](const fs::path& part) { fs::rename(file, part); });
  NoteUse(PathOf(digest.sha256));
  std::error_code none;
  fs::remove(file, none);  // if the cache had the blob already
}

void BlobCache::Trim() {
  if (bytes_ <= budget_bytes_) return;
  std::vector<std::pair<int64_t, std::string>> oldest;
  for (const auto& [sha256, entry] : entries_) {
    if (entry.present && entry.pins == 0) oldest.emplace_back(entry.last_use, sha256);
  }
  std::sort(oldest.begin(), oldest.end());
  for (const auto& [last_use, sha256] : oldest) {
    if (bytes_ <= budget_bytes_) return;
    const fs::path file = PathOf(sha256);
    if (HasLinkElsewhere(file)) continue;
    std::error_code error;
    fs::remove(file, error);
    if (error) continue;
    bytes_ -= entries_[sha256].bytes;
    entries_.erase(sha256);
  }
}

}  // namespace color3d
