// Zip archives of uncompressed files. Pure functions.
#pragma once

#include <string>
#include <vector>

namespace color3d {

struct ZipEntry {
  std::string name;
  std::string bytes;
};

// The same bytes for the same entries: all dates are 1 January 1980. Throws Error{kInvalidArgument}
// if a file or the archive would reach 4 GB.
std::string StoredZip(const std::vector<ZipEntry>& entries);

}  // namespace color3d
