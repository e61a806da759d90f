// Small file helpers. Every write is whole or absent: temporary file, fsync, rename.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace color3d {

// Reads a whole file as bytes. Throws Error{kNotFound} or Error{kDataLoss}; kResourceExhausted
// above `max_bytes`.
std::string ReadFile(const std::filesystem::path& path, int64_t max_bytes = int64_t{1} << 34);

// Replaces `path` atomically and durably. An existing file keeps its mode, and its owner and group
// where this process may change them. Throws Error{kResourceExhausted} if the disk is full,
// kFailedPrecondition if the folder cannot be written.
void WriteFileAtomic(const std::filesystem::path& path, std::string_view bytes);

// Exclusive lock on a folder among all processes, for changes that read a file and write it anew.
// Blocks until the lock is free. Throws Error if the folder cannot be opened or locked.
class FolderTurn {
 public:
  explicit FolderTurn(const std::filesystem::path& folder);
  ~FolderTurn();
  FolderTurn(const FolderTurn&) = delete;
  FolderTurn& operator=(const FolderTurn&) = delete;

 private:
  int fd_ = -1;
};

// Makes names created in the folder survive a power failure. Does nothing if the folder cannot be
// opened.
void SyncFolder(const std::filesystem::path& folder);

// Makes a finished temporary file durable under its final name (fsync, rename, fsync of folder).
void PublishFile(const std::filesystem::path& temporary, const std::filesystem::path& final_path);

// Regular files below `folder`, recursively, as sorted relative paths with '/' separators. Omits
// hidden files. Throws Error{kNotFound} if the folder does not exist, kFailedPrecondition with the
// name of a folder that cannot be read.
std::vector<std::string> ListFiles(const std::filesystem::path& folder);

// Returns true if `path` is relative, not empty, and has no "..", ".", empty or NUL component, no
// backslash and no control character: safe to join to a folder of ours.
bool IsSafeRelativePath(std::string_view path);

// Creates a new folder under `parent` and removes it with its contents on destruction.
class ScratchFolder {
 public:
  explicit ScratchFolder(
      const std::filesystem::path& parent = std::filesystem::temp_directory_path());
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace color3d
