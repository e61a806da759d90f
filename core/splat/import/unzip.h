// Reads files from untrusted zip archives.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace color3d {

// `bytes` must outlive it. The directory is read at once; immutable after that.
class ZipReader {
 public:
  // `name`: the archive's, for messages. Throws Error{kInvalidArgument} if it is no zip, is
  // truncated, is encrypted, spans several files or exceeds 4 GB (zip64), and if a file's name is
  // not a plain relative path, occurs twice or claims an impossible unpacked size.
  ZipReader(std::string_view bytes, std::string name);

  bool Has(const std::string& file) const { return entries_.contains(file); }
  // Reads a stored or deflated file and verifies its checksum. Throws Error{kInvalidArgument} if it
  // is missing, damaged, not at the position in the directory, or claims more than `max_bytes`.
  std::string Read(const std::string& file, uint64_t max_bytes) const;

 private:
  struct Entry {
    uint32_t method = 0;
    uint32_t crc = 0;
    uint32_t packed_bytes = 0;
    uint32_t bytes = 0;
    uint32_t offset = 0;  // of the local header
  };
  void ReadDirectory(size_t at, uint32_t count, size_t end);

  std::string_view bytes_;
  std::string name_;
  std::map<std::string, Entry> entries_;
};

}  // namespace color3d
