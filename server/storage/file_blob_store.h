// Blobs as read-only files blobs/ab/cd/<sha256>, each written to a temporary file, synced and
// renamed. Thread-safe.
#pragma once

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
  std::filesystem::path Fetch(const std::string& sha256) const override;
  FileDigest PutBytes(std::string_view bytes) override;
  FileDigest PutFile(const std::filesystem::path& file) override;
  void Adopt(const std::filesystem::path& file, const FileDigest& digest) override;
  void Remove(const std::string& sha256) override;
  bool SetAside(const std::string& sha256) override;
  int64_t damaged() const override { return damaged_; }
  void RequireSpace(int64_t bytes) const override;
  SpaceReservation Reserve(int64_t bytes) override;
  int64_t FreeBytes() const override;
  std::vector<std::string> ForEach(
      const std::function<bool(const StoredBlob&)>& visit) const override;
  bool RemoveIfUntouched(const StoredBlob& blob) override;
  int RemoveLeftovers(std::chrono::seconds age) override;

 private:
  int64_t UnpromisedBytes() const;  // below 0 if more is reserved than free
  // Returns true if the blob exists and is undamaged. Counts damaged blobs.
  bool IsThere(const FileDigest& digest);
  [[noreturn]] void ThrowFull(int64_t bytes, int64_t free) const;
  std::filesystem::path PathOf(const std::string& sha256) const;
  // Creates the folders above the file and syncs each level.
  std::filesystem::path PlaceFor(const std::string& sha256) const;

  std::filesystem::path folder_;
  BlobStoreOptions options_;
  StaleFiles stale_;
  std::atomic<int64_t> damaged_{0};
  std::shared_ptr<std::atomic<int64_t>> reserved_ = std::make_shared<std::atomic<int64_t>>(0);
};

}  // namespace color3d
