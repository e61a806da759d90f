// The directory of a zip archive as PyTorch writes it: every record stored, not compressed, so a
// record is a range of the file. Zip64 is read. Immutable after construction.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "core/weights/byte_source.h"

namespace color3d {

struct ZipRecord {
  uint64_t offset = 0;  // of the first byte of the content in the source
  uint64_t size = 0;    // bytes
};

using ZipDirectory = std::map<std::string, ZipRecord>;

// Throws Error{kInvalidArgument} when the archive is cut short or damaged, when records are
// compressed or encrypted, lie over each other, have the same name, or a name that would lead out
// of a folder ("../x", "/x"). Nothing is unpacked, so there are no zip bombs. Checksums are not
// looked at: PyTorch can be told to leave them out.
ZipDirectory ReadZipDirectory(const ByteSource& source);

}  // namespace color3d
