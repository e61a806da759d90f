// Files out of a zip that nobody vouches for.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace color3d {

// `bytes` must outlive it. The directory is read at once; immutable after that.
class ZipReader {
 public:
  // `name`: of the archive, for complaints. Throws Error{kInvalidArgument} for what is no zip, is
  // cut short, is encrypted, spans several files or is larger than 4 GB (zip64), and when a file's
  // name is not a plain relative path, is there twice or claims to unpack to more than it can.
  ZipReader(std::string_view bytes, std::string name);

  bool Has(const std::string& file) const { return entries_.contains(file); }
  // Stored or deflated, checked against its checksum. Throws Error{kInvalidArgument} when it is
  // missing, damaged, not where the directory says, or says that it has more than `max_bytes`.
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
