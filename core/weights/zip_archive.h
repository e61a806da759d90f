// The directory of a zip archive as PyTorch writes it. Arrays are stored, not compressed, so each
// is a range of the file; the source code in TorchScript archives is compressed, and never looked
// at. Zip64 is read. For this folder only.
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

// Throws Error{kInvalidArgument} when the archive is cut short or damaged, when records
// are encrypted, lie over each other, have the same name, or a name that would lead out of a folder
// ("../x", "/x"). Nothing is unpacked, so there are no zip bombs. Checksums are not looked at:
// PyTorch can be told to leave them out.
ZipDirectory ReadZipDirectory(const ByteSource& source);

// The record of that name when there is one that can be read in place, or nullptr. Throws
// Error{kInvalidArgument} when it is compressed.
const ZipRecord* FindStored(const ZipDirectory& directory,
                            const std::string& name,
                            const ByteSource& source);

}  // namespace color3d
