// Files on this machine that are sent to an object store, or received from it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace color3d {

// A file that is read at any place; closed by the destructor. Immutable, thread-safe. Throws
// Error{kDataLoss}.
class OpenBlob {
 public:
  explicit OpenBlob(const std::filesystem::path& file);
  ~OpenBlob();
  OpenBlob(const OpenBlob&) = delete;
  OpenBlob& operator=(const OpenBlob&) = delete;
  // As S3Source.
  size_t Read(int64_t offset, char* buffer, size_t size) const;

 private:
  [[noreturn]] void Throw() const;
  const std::filesystem::path file_;
  int fd_ = -1;
};

// A file that grows, created if there is none; closed by the destructor. Not thread-safe. Throws
// Error{kResourceExhausted, STORAGE_FULL} on a full disk, else kUnavailable.
class GrowingFile {
 public:
  explicit GrowingFile(const std::filesystem::path& file);
  ~GrowingFile();
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;
  int64_t size() const { return size_; }
  void Append(std::string_view data);

 private:
  [[noreturn]] void Throw() const;
  const std::filesystem::path file_;
  int fd_ = -1;
  int64_t size_ = 0;
};

}  // namespace color3d
