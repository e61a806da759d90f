// Reads the directory of a zip archive that PyTorch wrote. Arrays are stored uncompressed, so that
// each is a range of the file; the source code in TorchScript archives is compressed and never
// read. Supports Zip64. For this folder only.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "core/weights/byte_source.h"

namespace color3d {

struct ZipRecord {
  uint64_t offset = 0;  // of the first byte of the content in the source
  uint64_t size = 0;    // bytes in the source
  bool compressed = false;
};

using ZipDirectory = std::map<std::string, ZipRecord>;

// Throws Error{kInvalidArgument} if the archive is truncated or damaged, or if records are
// encrypted, overlap, have the same name, or a name that escapes the folder ("../x", "/x"). Nothing
// is unpacked, so that zip bombs have no effect. Checksums are not verified, since PyTorch may omit
// them.
ZipDirectory ReadZipDirectory(const ByteSource& source);

// Returns the record of that name, or nullptr if there is none. Throws Error{kInvalidArgument} if
// it is compressed.
const ZipRecord* FindStored(const ZipDirectory& directory,
                            const std::string& name,
                            const ByteSource& source);

}  // namespace color3d
