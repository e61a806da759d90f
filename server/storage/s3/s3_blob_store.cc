#include "server/storage/s3/s3_blob_store.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <exception>
#include <map>
#include <random>
#include <set>
#include <thread>
#include <utility>

#include "core/base/files.h"
#include "server/base/service_error.h"
#include "server/storage/s3/local_files.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr char kBlobs[] = "blobs/";
constexpr char kTouched[] = "touched/";
constexpr char kRemoving[] = "removing/";
// A remover sends its deletion within this time, so that one that was frozen does none later.
constexpr auto kRemovalTime = std::chrono::seconds(60);
constexpr auto kRemovalPoll = std::chrono::milliseconds(200);
constexpr int kTouchThreads = 16;

void RequireDigest(const std::string& sha256) {
  if (IsSha256Hex(sha256)) return;
  throw InvalidArgument("'{}' is not a SHA-256 digest: 64 lower-case hexadecimal digits",
                        sha256.substr(0, 80));
}

std::string KeyOf(const char* folder, const std::string& sha256) {
  RequireDigest(sha256);
  return folder + sha256.substr(0, 2) + "/" + sha256.substr(2, 2) + "/" + sha256;
}

// The digest of a key in one of the folders; empty for others.
std::string DigestOfKey(const char* folder, const std::string& key) {
  const std::string sha256 = key.substr(key.rfind('/') + 1);
  return IsSha256Hex(sha256) && key == KeyOf(folder, sha256) ? sha256 : "";
}

std::string Nonce() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random());
}

ServiceError Missing(const std::string& sha256) {
  return ServiceError(ErrorReason::kBlobMissing, "the blob {} is not stored; upload it", sha256);
}

// Calls `body` and gives failures of the store the reason of unreadable blobs.
template <typename Body>
auto Reading(const std::string& sha256, const Body& body) {
  try {
    return body();
  } catch (const S3Error& e) {
    throw ServiceError(
        ErrorReason::kBlobUnreadable, "cannot read the blob {}: {}", sha256, e.what());
  }
}

}  // namespace

S3BlobStore::S3BlobStore(S3BlobOptions options)
    : options_(std::move(options)),
      client_(options_.s3),
      space_(options_.folder.parent_path(), options_.reserve_bytes),
      cache_(options_.folder, options_.cache_bytes),
      touches_(options_.touch_memory) {}

int64_t S3BlobStore::TouchedNs(const std::string& mark, int64_t repeats) {
  if (mark.empty()) return repeats;
  constexpr int kDigits = 15;  // of four bits
  return std::stoll(Sha256Hex(mark).substr(0, kDigits), nullptr, 16) + repeats;
}

int64_t S3BlobStore::AgeOf(const std::string& modified) const {
  const int64_t written = ParseS3Time(modified), now = client_.StoreTime();
  return written <= 0 || now <= 0 ? 0 : now - written;
}

void S3BlobStore::WaitForRemoval(const std::string& sha256) const {
  const std::string key = KeyOf(kRemoving, sha256);
  const auto end = std::chrono::steady_clock::now() + 2 * kRemovalTime;
  while (const std::optional<S3Object> removal = client_.Head(key)) {
    if (AgeOf(removal->modified) > options_.removal_limit.count()) {
      client_.Delete(key, removal->etag);
      return;
    }
    if (std::chrono::steady_clock::now() >= end || !client_.Pause(kRemovalPoll)) {
      throw Error(ErrorCode::kUnavailable,
                  "the blob {} is being removed by a server that may have ended; try again in {} "
                  "minutes",
                  sha256,
                  options_.removal_limit.count() / 60 + 1);
    }
  }
}

bool S3BlobStore::Touch(const FileDigest& digest) const {
  RequireDigest(digest.sha256);
  if (touches_.Again(digest)) return true;
  return Reading(digest.sha256, [&] {
    const std::optional<std::string> mark =
        client_.PutBytes(KeyOf(kTouched, digest.sha256), Nonce(), S3Replace::kYes);
    WaitForRemoval(digest.sha256);
    const std::optional<S3Object> object = client_.Head(KeyOf(kBlobs, digest.sha256));
    if (!object || object->size_bytes != digest.size_bytes) return false;
    touches_.Add(digest, *mark);
    return true;
  });
}

std::vector<bool> S3BlobStore::TouchAll(const std::vector<FileDigest>& digests) const {
  std::vector<char> stored(digests.size());
  std::atomic<size_t> next{0};
  Mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (size_t i = next++; i < digests.size(); i = next++) stored[i] = Touch(digests[i]) ? 1 : 0;
    } catch (...) {
      next = digests.size();
      const MutexLock lock(mutex);
      failure = std::current_exception();
    }
  };
  std::vector<std::thread> threads;
  const size_t count = std::min<size_t>(kTouchThreads, digests.size());
  for (size_t i = 1; i < count; ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
  return {stored.begin(), stored.end()};
}

std::optional<StoredBlob> S3BlobStore::Look(const std::string& sha256) const {
  RequireDigest(sha256);
  return Reading(sha256, [&]() -> std::optional<StoredBlob> {
    const std::optional<S3Object> object = client_.Head(KeyOf(kBlobs, sha256));
    if (!object) return std::nullopt;
    const std::optional<S3Object> mark = client_.Head(KeyOf(kTouched, sha256));
    return StoredBlob{{sha256, object->size_bytes},
                      TouchedNs(mark ? mark->etag : std::string(), touches_.Repeats(sha256))};
  });
}

void S3BlobStore::Borrow(const std::string& sha256,
                         const std::function<void(const fs::path&)>& use) const {
  cache_.Use(
      sha256, [&](const fs::path& part) { Fill(sha256, part); }, use);
}

void S3BlobStore::Fill(const std::string& sha256, const fs::path& part) const {
  const std::optional<S3Object> object =
      Reading(sha256, [&] { return client_.Head(KeyOf(kBlobs, sha256)); });
  if (!object) {
    touches_.Forget(sha256);
    throw Missing(sha256);
  }
  const StoredBlob blob{{sha256, object->size_bytes}};
  space_.Require(blob.digest.size_bytes);
  std::error_code none;
  for (const bool is_last : {false, true}) {
    Reading(sha256, [&] { Download(blob, part); });
    if (DigestFile(part).sha256 == sha256) return;
    fs::remove(part, none);  // may continue an earlier fill of other bytes
    if (!is_last) continue;
    throw ServiceError(ErrorReason::kBlobDamaged,
                       "the blob {} is damaged in {}; upload it again, or run the job again with "
                       "skip_cache",
                       sha256,
                       client_.target().Name());
  }
}

void S3BlobStore::Download(const StoredBlob& blob, const fs::path& part) const {
  std::error_code none;
  const int64_t size = blob.digest.size_bytes;
  if (fs::exists(part, none) && static_cast<int64_t>(fs::file_size(part, none)) > size) {
    fs::remove(part, none);
  }
  GrowingFile file(part);
  if (file.size() == size) return;
  const bool is_there = client_.Get(KeyOf(kBlobs, blob.digest.sha256),
                                    file.size(),
                                    size - file.size(),
                                    [&](std::string_view bytes) { file.Append(bytes); });
  if (!is_there) throw Missing(blob.digest.sha256);
}

std::optional<std::string> S3BlobStore::DigestOfObject(const FileDigest& digest) const {
  Sha256 hash;
  const bool is_there =
      client_.Get(KeyOf(kBlobs, digest.sha256), 0, digest.size_bytes, [&](std::string_view bytes) {
        hash.Update(bytes);
      });
  if (!is_there) return std::nullopt;
  return hash.FinishHex();
}

bool S3BlobStore::IsIntact(const FileDigest& digest) const {
  return Reading(digest.sha256, [&] {
    const std::optional<S3Object> object = client_.Head(KeyOf(kBlobs, digest.sha256));
    if (!object) throw Missing(digest.sha256);
    if (object->size_bytes != digest.size_bytes) return false;
    const std::optional<std::string> actual = DigestOfObject(digest);
    if (!actual) throw Missing(digest.sha256);
    return *actual == digest.sha256;
  });
}

S3BlobStore::There S3BlobStore::CheckStored(const FileDigest& digest) {
  if (!Touch(digest)) return There::kNo;
  try {
    if (IsIntact(digest)) return There::kYes;
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kNotFound) throw;
    // Another server has set it aside since this one touched it.
    touches_.Forget(digest.sha256);
    Touch(digest);
    return There::kNo;
  }
  ++damaged_;
  return There::kDamaged;
}

void S3BlobStore::Store(const FileDigest& digest, const S3Source& source) {
  try {
    Write(digest, source);
  } catch (const S3Error& e) {
    constexpr std::array<std::string_view, 3> kFull{
        "QuotaExceeded", "XMinioStorageFull", "InsufficientStorage"};
    if (std::ranges::find(kFull, e.s3_code()) == kFull.end()) throw;
    throw ServiceError(ErrorReason::kStorageFull, "the object store is full: {}", e.what());
  }
}

void S3BlobStore::Write(const FileDigest& digest, const S3Source& source) {
  const There there = CheckStored(digest);
  if (there == There::kYes) return;
  const std::string key = KeyOf(kBlobs, digest.sha256);
  const auto replace = there == There::kDamaged ? S3Replace::kYes : S3Replace::kNo;
  const bool is_new = client_.Put(key, digest.sha256, digest.size_bytes, source, replace);
  // Stored by another server meanwhile, or of another size.
  if (!is_new && !IsIntact(digest)) {
    client_.Put(key, digest.sha256, digest.size_bytes, source, S3Replace::kYes);
  }
  if (!Touch(digest)) {
    throw Error(ErrorCode::kUnavailable,
                "{} does not have the blob {} that was just written; try again",
                client_.target().Name(),
                digest.sha256);
  }
}

FileDigest S3BlobStore::PutBytes(std::string_view bytes) {
  const FileDigest digest{Sha256Hex(bytes), static_cast<int64_t>(bytes.size())};
  Store(digest, BytesSource(bytes));
  return digest;
}

FileDigest S3BlobStore::PutFile(const fs::path& file) {
  const FileDigest digest = DigestFile(file);
  Adopt(file, digest);
  return digest;
}

void S3BlobStore::Adopt(const fs::path& file, const FileDigest& digest) {
  RequireDigest(digest.sha256);
  {
    const OpenBlob open(file);
    Store(digest, [&](int64_t offset, char* buffer, size_t size) {
      return open.Read(offset, buffer, size);
    });
  }
  try {
    cache_.Put(file, digest);
  } catch (const std::exception& e) {  // e.g. on another disk
    spdlog::debug("{} is not cached: {}", file.string(), e.what());
  }
  std::error_code none;
  fs::remove(file, none);
}

void S3BlobStore::Remove(const std::string& sha256) {
  touches_.Forget(sha256);
  client_.Delete(KeyOf(kBlobs, sha256));
  client_.Delete(KeyOf(kTouched, sha256));
}

bool S3BlobStore::SetAside(const std::string& sha256) {
  const std::string key = KeyOf(kBlobs, sha256);
  const std::optional<S3Object> read = client_.Head(key);
  if (!read) return false;
  const std::optional<std::string> digest = DigestOfObject({sha256, read->size_bytes});
  if (!digest || *digest == sha256) return false;
  // A replacement has another ETag.
  const std::optional<S3Object> now = client_.Head(key);
  if (!now || now->etag != read->etag || !client_.Delete(key, read->etag)) return false;
  touches_.Forget(sha256);
  ++damaged_;
  return true;
}

std::vector<std::string> S3BlobStore::ForEach(
    const std::function<bool(const StoredBlob&)>& visit) const {
  std::map<std::string, std::string> marks;
  client_.List(kTouched, [&](const S3Object& object) {
    const std::string sha256 = DigestOfKey(kTouched, object.key);
    if (!sha256.empty()) marks[sha256] = object.etag;
    return true;
  });
  client_.List(kBlobs, [&](const S3Object& object) {
    const std::string sha256 = DigestOfKey(kBlobs, object.key);
    if (sha256.empty()) return true;
    const auto mark = marks.find(sha256);
    return visit(
        {{sha256, object.size_bytes},
         TouchedNs(mark == marks.end() ? std::string() : mark->second, touches_.Repeats(sha256))});
  });
  return {};
}

bool S3BlobStore::RemoveIfUntouched(const StoredBlob& blob) {
  const std::string& sha256 = blob.digest.sha256;
  const std::string removing = KeyOf(kRemoving, sha256);
  const std::string nonce = Nonce();
  const auto begin = std::chrono::steady_clock::now();
  if (!client_.PutBytes(removing, nonce, S3Replace::kNo) && client_.GetBytes(removing) != nonce) {
    return false;  // another server removes it
  }
  bool is_due = false;
  try {
    is_due = IsDue(blob) && std::chrono::steady_clock::now() - begin < kRemovalTime;
  } catch (const Error&) {
    EndRemoval(removing);
    throw;
  }
  if (is_due) {
    client_.Delete(KeyOf(kBlobs, sha256));
    client_.Delete(KeyOf(kTouched, sha256));
  }
  EndRemoval(removing);
  return is_due;
}

bool S3BlobStore::IsDue(const StoredBlob& blob) {
  const std::string& sha256 = blob.digest.sha256;
  const std::optional<S3Object> mark = client_.Head(KeyOf(kTouched, sha256));
  const std::string etag = mark ? mark->etag : std::string();
  // Another process may have counted touches that it did not write.
  if (mark && !touches_.IsOwn(sha256, etag) &&
      AgeOf(mark->modified) < options_.young_mark.count()) {
    return false;
  }
  if (!client_.Head(KeyOf(kBlobs, sha256))) return false;
  const int64_t repeats = touches_.Repeats(sha256);
  // From here on, a touch in this process sees the removal.
  return TouchedNs(etag, repeats) == blob.touched_ns && touches_.Retire(sha256, repeats);
}

// One that is left over delays touches of this blob until it is old.
void S3BlobStore::EndRemoval(const std::string& key) {
  try {
    client_.Delete(key);
  } catch (const Error& e) {
    spdlog::warn("the mark of a removal is left in the store: {}", e.what());
  }
}

int S3BlobStore::RemoveLeftovers(std::chrono::seconds age) {
  int removed = 0;
  for (const S3Client::Upload& upload : client_.ListUploads(kBlobs)) {
    if (AgeOf(upload.begun) < age.count()) continue;
    client_.Abort(upload);
    ++removed;
  }
  std::set<std::string> blobs;
  client_.List(kBlobs, [&](const S3Object& object) {
    blobs.insert(DigestOfKey(kBlobs, object.key));
    return true;
  });
  std::vector<S3Object> old;
  const auto collect = [&](const S3Object& object) {
    const bool is_needed = object.key.starts_with(kTouched) &&
                           blobs.contains(object.key.substr(object.key.rfind('/') + 1));
    const auto limit = std::max(age, options_.removal_limit).count();
    if (!is_needed && AgeOf(object.modified) >= limit) old.push_back(object);
    return true;
  };
  client_.List(kTouched, collect);
  client_.List(kRemoving, collect);
  for (const S3Object& object : old) removed += client_.Delete(object.key, object.etag) ? 1 : 0;
  return removed;
}

}  // namespace color3d
