// Cache of small results between runs: one file per entry, named by the digest of its inputs.
// Returns the stored value or nothing: an entry that is torn, damaged or belongs to another key
// counts as absent. Never fails: without disk space or permission it stores nothing. Thread-safe;
// several processes may share the folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace color3d {

class FileCache {
 public:
  // An empty folder name gives a cache that stores nothing. The folder is created on first use.
  FileCache(std::filesystem::path folder, int64_t max_bytes)
      : folder_(std::move(folder)), max_bytes_(max_bytes) {}

  // `key`: 64 hexadecimal digits (Sha256Hex). A hit counts as use.
  std::optional<std::string> Get(const std::string& key) const;
  // Not synced to disk: the digest reveals a torn entry.
  void Put(const std::string& key, std::string_view bytes) const;
  // Removes the least recently used entries until the rest holds at most `max_bytes`.
  void Trim() const;

 private:
  std::filesystem::path folder_;
  int64_t max_bytes_;
};

}  // namespace color3d
