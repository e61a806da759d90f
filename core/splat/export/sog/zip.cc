#include "core/splat/export/sog/zip.h"

#include <zlib.h>

#include <cstdint>
#include <limits>

#include "core/base/error.h"
#include "core/splat/export/little_endian.h"

namespace color3d {
namespace {

constexpr uint32_t kLocalSignature = 0x04034b50;
constexpr uint32_t kCentralSignature = 0x02014b50;
constexpr uint32_t kEndSignature = 0x06054b50;
constexpr uint16_t kVersion = 20;        // 2.0: folders and plain files
constexpr uint16_t kFirstDate = 0x0021;  // 1980-01-01
constexpr uint64_t kLimit = std::numeric_limits<uint32_t>::max();

void Put16(uint64_t value, std::string* out) { PutLittleEndian(value, 2, out); }
void Put32(uint64_t value, std::string* out) { PutLittleEndian(value, 4, out); }

// Fields common to the local and the central header.
void PutFacts(const ZipEntry& entry, uint32_t crc, std::string* out) {
  Put16(kVersion, out);
  Put16(0, out);  // flags
  Put16(0, out);  // stored
  Put16(0, out);  // time
  Put16(kFirstDate, out);
  Put32(crc, out);
  Put32(entry.bytes.size(), out);  // in the archive
  Put32(entry.bytes.size(), out);
  Put16(entry.name.size(), out);
  Put16(0, out);  // extra field
}

}  // namespace

std::string StoredZip(const std::vector<ZipEntry>& entries) {
  std::string out, directory;
  for (const ZipEntry& entry : entries) {
    if (out.size() + entry.bytes.size() >= kLimit) {
      throw InvalidArgument("{} makes the archive larger than the 4 GB of a zip", entry.name);
    }
    const size_t offset = out.size();
    const uint32_t crc = static_cast<uint32_t>(
        crc32_z(0, reinterpret_cast<const Bytef*>(entry.bytes.data()), entry.bytes.size()));
    Put32(kLocalSignature, &out);
    PutFacts(entry, crc, &out);
    out += entry.name + entry.bytes;

    Put32(kCentralSignature, &directory);
    Put16(kVersion, &directory);  // made by
    PutFacts(entry, crc, &directory);
    Put16(0, &directory);  // comment
    Put16(0, &directory);  // disk
    Put16(0, &directory);  // internal attributes
    Put32(0, &directory);  // external attributes
    Put32(offset, &directory);
    directory += entry.name;
  }
  const size_t begin = out.size();
  out += directory;
  Put32(kEndSignature, &out);
  Put16(0, &out);  // this disk
  Put16(0, &out);  // disk of the directory
  Put16(entries.size(), &out);
  Put16(entries.size(), &out);
  Put32(directory.size(), &out);
  Put32(begin, &out);
  Put16(0, &out);  // comment
  return out;
}

}  // namespace color3d
