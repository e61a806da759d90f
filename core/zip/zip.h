// Reads and writes zip archives. The reader is for untrusted files and supports zip64; the writer
// stores its files uncompressed.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/base/bytes/byte_source.h"

namespace color3d {

struct ZipRecord {
  uint64_t offset = 0;       // of the first byte of the content in the source
  uint64_t packed_size = 0;  // bytes in the source
  uint64_t size = 0;         // bytes of the content; equal to packed_size if stored
  uint32_t checksum = 0;     // CRC-32 of the content
  uint16_t method = 0;       // of compression; 0 if stored uncompressed
};

// Immutable, thread-safe.
class ZipReader {
 public:
  // Reads the directory. `source` must outlive the reader. Throws Error{kInvalidArgument} if the
  // archive is truncated, damaged or in several files, or if records are encrypted, overlap, claim
  // an impossible size, have the same name, or a name that is not a plain relative path ("../x",
  // "/x").
  explicit ZipReader(const ByteSource& source);

  const std::map<std::string, ZipRecord>& records() const { return records_; }
  // Returns the record of that name, or nullptr if there is none.
  const ZipRecord* Find(const std::string& name) const;
  // Reads a stored or deflated record and verifies its checksum. Throws Error{kInvalidArgument} if
  // it is missing, damaged, compressed by another method, or larger than `max_bytes`.
  std::string Read(const std::string& name, uint64_t max_bytes) const;

 private:
  const ByteSource& source_;
  std::map<std::string, ZipRecord> records_;
};

struct ZipEntry {
  std::string name;
  std::string bytes;
};

// Returns an archive of stored entries: the same bytes for the same entries, since all dates are
// 1 January 1980. Throws Error{kInvalidArgument} if it would reach 4 GB.
std::string StoredZip(const std::vector<ZipEntry>& entries);

}  // namespace color3d
