// The blobs of a server on another machine, with a cache on this one. Transfers resume after broken
// connections, and are verified by digest at both ends. Thread-safe.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "server/storage/blob_cache.h"
#include "server/storage/worker_blobs.h"
#include "server/worker/remote/worker_link.h"

namespace color3d {

class RemoteBlobs : public WorkerBlobs {
 public:
  // Both must outlive this object.
  RemoteBlobs(WorkerLink& link, BlobCache& cache) : link_(link), cache_(cache) {}

  bool Touch(const FileDigest& digest) const override;
  std::optional<StoredBlob> Look(const std::string& sha256) const override;
  void Borrow(const std::string& sha256,
              const std::function<void(const std::filesystem::path&)>& use) const override;
  // Not cached: only checkpoints are bytes, and later attempts seldom run here.
  FileDigest PutBytes(std::string_view bytes) override;
  // The file becomes part of the cache, because later jobs of the scene read it.
  FileDigest PutFile(const std::filesystem::path& file) override;
  // Not cached, as PutBytes. Removes the file.
  void Adopt(const std::filesystem::path& file, const FileDigest& digest) override;
  // Does nothing: the server refuses an upload for which it has no space.
  void RequireSpace(int64_t bytes) const override;
  bool RemoveIfUntouched(const StoredBlob& blob) override;

 private:
  // Reads `size` bytes from `offset`.
  using Source = std::function<std::string(int64_t offset, int64_t size)>;
  // Sends the bytes unless the server has them.
  void Upload(const FileDigest& digest, const Source& source) const;
  void UploadFile(const std::filesystem::path& file, const FileDigest& digest) const;
  void Download(const std::string& sha256, const std::filesystem::path& part) const;

  WorkerLink& link_;
  BlobCache& cache_;
};

}  // namespace color3d
