// Small results that are worth keeping between runs, one file each, by the digest of what they were
// computed from. What it returns is what was put in, or nothing: an entry that is torn, damaged or
// of another key counts as absent. It never fails: without room or permission it keeps nothing.
// Thread-safe; several processes may share the folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace color3d {

class FileCache {
 public:
  // An empty folder name: a cache that keeps nothing. The folder is made when it is needed.
  FileCache(std::filesystem::path folder, int64_t max_bytes)
      : folder_(std::move(folder)), max_bytes_(max_bytes) {}

  // `key`: 64 hexadecimal digits (Sha256Hex). A hit counts as use.
  std::optional<std::string> Get(const std::string& key) const;
  // Not synced to disk: a torn entry is noticed by its digest.
  void Put(const std::string& key, std::string_view bytes) const;
  // Removes the entries that were used longest ago until `max_bytes` hold the rest.
  void Trim() const;

 private:
  std::filesystem::path folder_;
  int64_t max_bytes_;
};

}  // namespace color3d
