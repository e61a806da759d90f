// Blobs as read-only files blobs/ab/cd/<sha256>, each written to a temporary file, synced and
// renamed. Thread-safe.
#pragma once

#include <atomic>

#include "server/storage/blob_store.h"
#include "server/storage/stale_files.h"

namespace color3d {

struct BlobStoreOptions {
  // Refuses writes (kResourceExhausted, STORAGE_FULL) that would leave less than this free.
  int64_t reserve_bytes = int64_t{256} << 20;
};

class FileBlobStore : public BlobStore {
 public:
  explicit FileBlobStore(const std::filesystem::path& folder, BlobStoreOptions options = {});

  bool Touch(const FileDigest& digest) const override;
  std::optional<StoredBlob> Look(const std::string& sha256) const override;
  // Returns the path of a read-only file. Throws Error{kNotFound, BLOB_MISSING}.
  virtual std::filesystem::path Fetch(const std::string& sha256) const;
  void Borrow(const std::string& sha256,
              const std::function<void(const std::filesystem::path&)>& use) const override {
    use(Fetch(sha256));
  }
  bool IsIntact(const FileDigest& digest) const override;
  FileDigest PutBytes(std::string_view bytes) override;
  FileDigest PutFile(const std::filesystem::path& file) override;
  void Adopt(const std::filesystem::path& file, const FileDigest& digest) override;
  void Remove(const std::string& sha256) override;
  bool SetAside(const std::string& sha256) override;
  int64_t damaged() const override { return damaged_; }
  void RequireSpace(int64_t bytes) const override { space_.Require(bytes); }
  SpaceReservation Reserve(int64_t bytes) override { return space_.Reserve(bytes); }
  int64_t FreeBytes() const override { return space_.FreeBytes(); }
  std::vector<std::string> ForEach(
      const std::function<bool(const StoredBlob&)>& visit) const override;
  bool RemoveIfUntouched(const StoredBlob& blob) override;
  int RemoveLeftovers(std::chrono::seconds age) override;

 private:
  // Returns true if the blob exists and is undamaged. Counts damaged blobs.
  bool IsThere(const FileDigest& digest);
  std::filesystem::path PathOf(const std::string& sha256) const;
  // Creates the folders above the file and syncs each level.
  std::filesystem::path PlaceFor(const std::string& sha256) const;

  std::filesystem::path folder_;
  DiskSpace space_;
  StaleFiles stale_;
  std::atomic<int64_t> damaged_{0};
};

}  // namespace color3d
