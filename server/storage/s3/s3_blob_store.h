// Blobs as objects of a bucket, with a cache on this machine. Several servers may share the bucket.
// Thread-safe.
//
//   blobs/ab/cd/SHA-256     the bytes; the layout of a data folder, so that tools can copy either
//   touched/ab/cd/SHA-256   mark: written anew by each touch
//   removing/ab/cd/SHA-256  mark: a server is removing the blob
//
// An object store has no lock over two objects. Whoever needs a blob writes its touch mark and then
// looks for a removal; whoever removes one writes the removal mark and then looks at the touch
// mark. Reads see all earlier writes, so at least one of the two sees the other: the remover gives
// up, or the other waits until the removal has ended. See server/README.md, "Blobs in an object
// store".
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/storage/blob_cache.h"
#include "server/storage/blob_store.h"
#include "server/storage/s3/s3_client.h"
#include "server/storage/s3/touch_memory.h"

namespace color3d {

struct S3BlobOptions {
  S3Options s3;
  // Folder of files that are being fetched, and of the cache; on the disk of the uploads.
  std::filesystem::path folder;
  int64_t cache_bytes = int64_t{10} << 30;
  int64_t reserve_bytes = int64_t{256} << 20;  // as BlobStoreOptions
  // A blob that this process has touched within this time is not marked again. Well below the
  // smallest grace period of the collection, an hour.
  std::chrono::milliseconds touch_memory{600'000};
  // A mark that another process has written within this time protects the blob in any case, because
  // that process may have counted further touches. More than touch_memory.
  std::chrono::seconds young_mark{3600};
  // A removal that began before this time is that of a server that has ended.
  std::chrono::seconds removal_limit{600};
};

class S3BlobStore : public BlobStore {
 public:
  // Sends nothing. Throws Error{kFailedPrecondition} if the folder cannot be used.
  explicit S3BlobStore(S3BlobOptions options);

  // Ends requests under way and refuses further ones (kUnavailable), so that a server that ends
  // does not wait for the store.
  void Stop() { client_.Stop(); }
  S3Client& client() { return client_; }
  int64_t cached_bytes() const { return cache_.bytes(); }

  bool Touch(const FileDigest& digest) const override;
  std::vector<bool> TouchAll(const std::vector<FileDigest>& digests) const override;
  std::optional<StoredBlob> Look(const std::string& sha256) const override;
  // From the cache, which is filled first.
  void Borrow(const std::string& sha256,
              const std::function<void(const std::filesystem::path&)>& use) const override;
  bool IsIntact(const FileDigest& digest) const override;
  FileDigest PutBytes(std::string_view bytes) override;
  // The file becomes part of the cache.
  FileDigest PutFile(const std::filesystem::path& file) override;
  void Adopt(const std::filesystem::path& file, const FileDigest& digest) override;
  void Remove(const std::string& sha256) override;
  // Removes the object; versions of the bucket keep it.
  bool SetAside(const std::string& sha256) override;
  int64_t damaged() const override { return damaged_; }
  void RequireSpace(int64_t bytes) const override { space_.Require(bytes); }
  SpaceReservation Reserve(int64_t bytes) override { return space_.Reserve(bytes); }
  int64_t FreeBytes() const override { return space_.FreeBytes(); }
  // Throws if the store cannot be reached; returns no unreadable paths.
  std::vector<std::string> ForEach(
      const std::function<bool(const StoredBlob&)>& visit) const override;
  // Also returns false for a blob that another process has touched within `young_mark`.
  bool RemoveIfUntouched(const StoredBlob& blob) override;
  // Removes parts of unfinished uploads, marks of blobs that are gone, and removals of servers that
  // have ended, all older than `age` by the clock of the store.
  int RemoveLeftovers(std::chrono::seconds age) override;

 private:
  enum class There { kNo, kYes, kDamaged };
  // Touches the blob, and rereads it if it is stored. Counts damaged blobs.
  There CheckStored(const FileDigest& digest);
  // Writes the blob unless it is stored. Throws STORAGE_FULL if the store says so.
  void Store(const FileDigest& digest, const S3Source& source);
  void Write(const FileDigest& digest, const S3Source& source);
  // Waits for a removal that is under way.
  void WaitForRemoval(const std::string& sha256) const;
  // Of the ETag of the touch mark (empty: none) and the touches that were only counted.
  static int64_t TouchedNs(const std::string& mark, int64_t repeats);
  // Returns true if nobody has touched the blob since, or can do so before the end of its removal.
  bool IsDue(const StoredBlob& blob);
  void EndRemoval(const std::string& key);
  void Fill(const std::string& sha256, const std::filesystem::path& part) const;
  void Download(const StoredBlob& blob, const std::filesystem::path& part) const;
  // Reads the object; returns its digest, or nothing if there is none.
  std::optional<std::string> DigestOfObject(const FileDigest& digest) const;
  // Seconds since a time of the store, by its clock; 0 if unknown.
  int64_t AgeOf(const std::string& modified) const;

  const S3BlobOptions options_;
  mutable S3Client client_;
  DiskSpace space_;
  mutable BlobCache cache_;
  mutable TouchMemory touches_;
  std::atomic<int64_t> damaged_{0};
};

}  // namespace color3d
