// Content-addressed files: blobs/ab/cd/<sha256>, read-only, each written to a temporary file on the
// same filesystem, synced and renamed. Thread-safe; several processes may share the folder.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>

#include "core/base/digest.h"

namespace color3d {

struct BlobStoreOptions {
  // Writes are refused (kResourceExhausted, STORAGE_FULL) when less than this would stay free.
  int64_t reserve_bytes = int64_t{256} << 20;
};

class BlobStore {
 public:
  explicit BlobStore(const std::filesystem::path& folder, BlobStoreOptions options = {});

  // Whether the blob is there with this size; keeps it from the sweep for another grace period.
  bool Touch(const FileDigest& digest) const;
  // Path of the read-only file. Throws Error{kNotFound, BLOB_MISSING}.
  std::filesystem::path Fetch(const std::string& sha256) const;
  FileDigest PutBytes(std::string_view bytes);
  // Moves the file in (same filesystem; the original is gone afterwards).
  FileDigest PutFile(const std::filesystem::path& file);
  // As PutFile, for a file whose digest the caller has just computed.
  void Adopt(const std::filesystem::path& file, const FileDigest& digest);
  void Remove(const std::string& sha256);

  // Throws Error{kResourceExhausted, STORAGE_FULL} when `bytes` more would not leave the reserve.
  void RequireSpace(int64_t bytes) const;
  int64_t FreeBytes() const;

  struct Sweep {
    int removed = 0;
    int64_t bytes = 0;
  };
  // Removes blobs older than `grace` that are not in `referenced`. What is put or touched after
  // `referenced` was read is younger than that, and stays.
  Sweep RemoveUnreferenced(const std::set<std::string>& referenced, std::chrono::seconds grace);

 private:
  std::filesystem::path PathOf(const std::string& sha256) const;

  std::filesystem::path folder_;
  BlobStoreOptions options_;
};

}  // namespace color3d
